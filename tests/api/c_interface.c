/* SPDX-License-Identifier: Apache-2.0 */
/* The C interface, from C. Prints what fails and returns how many checks did. */
#include <raywave/raywave.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define CHECK(condition)                                                                    \
  do {                                                                                      \
    if (!(condition)) {                                                                     \
      ++failures;                                                                           \
      fprintf(stderr, "%s:%d: %s (%s)\n", __FILE__, __LINE__, #condition, raywave_error()); \
    }                                                                                       \
  } while (0)

enum { nx = 48, ny = 32, frames = 2, samples = nx * ny * frames };

static const char* const scene =
    "[hologram]\nresolution = [48, 32]\npitch = \"4 um\"\n[sampling]\npitch = \"20 um\"\n"
    "[[light]]\ndirection = [0, 0, 1]\n"
    "[[object]]\nwidth = \"0.2 mm\"\nposition = [0, 0, \"10 mm\"]\n";
static const double square[] = {-0.5, -0.5, 0, -0.5, 0.5, 0, 0.5, 0.5, 0, 0.5, -0.5, 0};
static const uint32_t faces[] = {0, 1, 2, 0, 2, 3};

static int count_steps(const char* what, double share, void* context) {
  ++*(int*)context;
  return what[0] != '\0' && share >= 0 && share <= 1;
}

static int stop(const char* what, double share, void* context) {
  (void)what, (void)share, (void)context;
  return 0;
}

static void check_errors(void) {
  raywave_renderer* renderer = (raywave_renderer*)&failures;
  CHECK(raywave_open("none.toml", NULL, NULL, &renderer) == RAYWAVE_INPUT_ERROR);
  CHECK(renderer == NULL);
  CHECK(strstr(raywave_error(), "none.toml") != NULL);
  CHECK(raywave_open(NULL, NULL, NULL, &renderer) == RAYWAVE_INPUT_ERROR);
  CHECK(raywave_open_text(scene, NULL, NULL, NULL, NULL) == RAYWAVE_INPUT_ERROR);
  CHECK(raywave_open_text(scene, NULL, "wrp.padding=99", NULL, &renderer) == RAYWAVE_INPUT_ERROR);
  CHECK(strstr(raywave_error(), "wrp.padding") != NULL);
  CHECK(raywave_render(NULL, NULL, 0) == RAYWAVE_INPUT_ERROR);
  CHECK(raywave_size(NULL, NULL, NULL, NULL, NULL) == RAYWAVE_INPUT_ERROR);
  raywave_close(NULL);
}

int main(void) {
  static uint8_t first[samples + 1], second[samples + 1];
  static uint8_t lasers[RAYWAVE_MOST_LASERS * nx * ny];
  static float field[2 * samples];
  const double position[] = {0, 0, 0.01}, turned[] = {0, 30, 0}, none[] = {0, 0, 0};
  raywave_renderer *renderer = NULL, *other = NULL;
  int width = 0, height = 0, count = 0, objects = 0, steps = 0, i = 0;
  double power = 0, wavelengths[RAYWAVE_MOST_LASERS], powers[RAYWAVE_MOST_LASERS];

  CHECK(strcmp(raywave_version(), RAYWAVE_VERSION) == 0);
  check_errors();

  CHECK(raywave_open_text(scene, ".",
                          "sampling.frames=2\nsampling.seed=7\nhologram.wavelength=900 nm", NULL,
                          &renderer) == RAYWAVE_OK);
  if (!renderer) return 1;
  CHECK(raywave_size(renderer, &width, &height, &count, &objects) == RAYWAVE_OK);
  CHECK(width == nx && height == ny && count == frames && objects == 1);

  CHECK(strcmp(raywave_notes(renderer), "") == 0);

  /* Neither a mesh, nor memory enough */
  CHECK(raywave_render(renderer, first, samples) == RAYWAVE_INPUT_ERROR);
  CHECK(strstr(raywave_error(), "mesh") != NULL);
  CHECK(raywave_set_mesh(renderer, 1, square, 4, faces, 2) == RAYWAVE_INPUT_ERROR);
  CHECK(raywave_set_mesh(renderer, 0, square, 3, faces, 2) == RAYWAVE_INPUT_ERROR);
  CHECK(raywave_set_mesh(renderer, 0, square, 4, faces, 2) == RAYWAVE_OK);
  CHECK(raywave_render(renderer, first, samples - 1) == RAYWAVE_INPUT_ERROR);
  CHECK(strstr(raywave_error(), "levels") != NULL);
  CHECK(raywave_render_field(renderer, first, samples, field, 2 * samples - 1) ==
        RAYWAVE_INPUT_ERROR);

  /* A picture with its field; nothing is written behind it */
  first[samples] = second[samples] = 0xa5;
  CHECK(raywave_set_progress(renderer, count_steps, &steps) == RAYWAVE_OK);
  CHECK(raywave_render_field(renderer, first, samples, field, 2 * samples) == RAYWAVE_OK);
  CHECK(steps > 1);
  CHECK(first[samples] == 0xa5);
  for (i = 0; i < 2 * samples; ++i) power += (double)field[i] * field[i];
  CHECK(power > 0);
  CHECK(strstr(raywave_notes(renderer), "hologram.wavelength 900 nm is no visible light") != NULL);
  CHECK(raywave_notes(renderer)[strlen(raywave_notes(renderer)) - 1] == '\n');

  /* Stopped, and as before afterwards */
  CHECK(raywave_set_progress(renderer, stop, NULL) == RAYWAVE_OK);
  CHECK(raywave_render(renderer, second, samples) == RAYWAVE_CANCELLED);
  CHECK(raywave_set_progress(renderer, NULL, NULL) == RAYWAVE_OK);
  CHECK(raywave_render(renderer, second, samples) == RAYWAVE_OK);
  CHECK(memcmp(first, second, samples + 1) == 0);

  /* Poses and seeds count */
  CHECK(raywave_set_pose(renderer, 0, position, turned) == RAYWAVE_OK);
  CHECK(raywave_set_pose(renderer, 1, position, turned) == RAYWAVE_INPUT_ERROR);
  CHECK(raywave_set_pose(renderer, 0, NULL, turned) == RAYWAVE_INPUT_ERROR);
  CHECK(raywave_render(renderer, second, samples) == RAYWAVE_OK);
  CHECK(memcmp(first, second, samples) != 0);
  CHECK(raywave_set_pose(renderer, 0, position, none) == RAYWAVE_OK);
  CHECK(raywave_set_seed(renderer, 8) == RAYWAVE_OK);
  CHECK(raywave_render(renderer, second, samples) == RAYWAVE_OK);
  CHECK(memcmp(first, second, samples) != 0);

  /* A pose stays with an object whose mesh changes */
  CHECK(raywave_set_pose(renderer, 0, position, turned) == RAYWAVE_OK);
  CHECK(raywave_set_mesh(renderer, 0, square, 4, faces, 2) == RAYWAVE_OK);
  CHECK(raywave_render(renderer, second, samples) == RAYWAVE_OK);
  CHECK(raywave_open_text(
            scene, NULL,
            "sampling.frames=2\nobject.0.rotation=[0, 30, 0]\nhologram.wavelength=900 nm", NULL,
            &other) == RAYWAVE_OK);
  CHECK(raywave_set_seed(other, 8) == RAYWAVE_OK);
  CHECK(raywave_set_mesh(other, 0, square, 4, faces, 2) == RAYWAVE_OK);
  CHECK(raywave_render(other, first, samples) == RAYWAVE_OK);
  CHECK(memcmp(first, second, samples) == 0);

  /* Three lasers, one after another */
  raywave_close(other);
  other = NULL;
  CHECK(raywave_lasers(renderer, &count, wavelengths, powers) == RAYWAVE_OK);
  CHECK(count == 1 && powers[0] == 1);
  CHECK(raywave_open_text(scene, NULL, "hologram.wavelength=[\"638 nm\", \"520 nm\", \"450 nm\"]",
                          NULL, &other) == RAYWAVE_OK);
  CHECK(raywave_lasers(other, &count, wavelengths, powers) == RAYWAVE_OK);
  CHECK(count == RAYWAVE_MOST_LASERS && wavelengths[1] == 520e-9 && powers[1] == 0);
  CHECK(raywave_set_mesh(other, 0, square, 4, faces, 2) == RAYWAVE_OK);
  CHECK(raywave_render(other, lasers, sizeof lasers - 1) == RAYWAVE_INPUT_ERROR);
  CHECK(raywave_render(other, lasers, sizeof lasers) == RAYWAVE_OK);
  CHECK(raywave_lasers(other, NULL, NULL, powers) == RAYWAVE_OK);
  power = powers[0] + powers[1] + powers[2];
  CHECK(power > 0.999999 && power < 1.000001);
  CHECK(memcmp(lasers, lasers + nx * ny, nx * ny) != 0);

  raywave_close(other);
  raywave_close(renderer);
  if (failures == 0) puts("the C interface does what its header says");
  return failures;
}
