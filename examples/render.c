/* SPDX-License-Identifier: Apache-2.0 */
/* Renders a scene from C into a PGM picture.
 *
 * usage: render SCENE PICTURE.pgm */
#include <raywave/raywave.h>
#include <stdio.h>
#include <stdlib.h>

static int fail(void) {
  fprintf(stderr, "render: %s\n", raywave_error());
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 3) return fprintf(stderr, "usage: render SCENE PICTURE.pgm\n"), 2;

  raywave_renderer* renderer = NULL;
  if (raywave_open(argv[1], "sampling.frames=1", NULL, &renderer) != RAYWAVE_OK) return fail();
  int nx = 0, ny = 0;
  raywave_size(renderer, &nx, &ny, NULL, NULL);

  const size_t bytes = (size_t)nx * (size_t)ny;
  uint8_t* levels = malloc(bytes);
  if (!levels || raywave_render(renderer, levels, bytes) != RAYWAVE_OK) return fail();

  FILE* file = fopen(argv[2], "wb");
  if (!file) return perror(argv[2]), 1;
  fprintf(file, "P5 %d %d 255\n", nx, ny);
  fwrite(levels, 1, bytes, file);
  fclose(file);
  free(levels);
  raywave_close(renderer);
  return 0;
}
