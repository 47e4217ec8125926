/* SPDX-License-Identifier: Apache-2.0 */
/* C interface of raywave (docs/library.md): open a scene, move its objects, render into memory of
 * the caller's.
 *
 *     raywave_renderer* renderer = NULL;
 *     if (raywave_open("scene.toml", "sampling.frames=4", NULL, &renderer) != RAYWAVE_OK)
 *       fail(raywave_error());
 *     raywave_render(renderer, levels, bytes);
 *     raywave_close(renderer);
 *
 * Axes and units: right-handed, metres and degrees, the hologram in the plane z = 0, y up, the
 * scene beyond it (z > 0), before it or both. Pictures have row 0 on top. Texts are UTF-8.
 *
 * Every function that returns a status leaves, when it is not RAYWAVE_OK, one line for the user in
 * raywave_error(). No function ends the program, prints, or lets a C++ exception out.
 *
 * Threads: calls on one renderer take turns; several renderers work at the same time. close comes
 * last, and once.
 */
#ifndef RAYWAVE_H
#define RAYWAVE_H

#include <raywave/export.h>
#include <raywave/version.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What a call returns; the numbers are the exit codes of the command line. */
enum {
  RAYWAVE_OK = 0,
  RAYWAVE_BUG = 1,          /* neither of those below: please report it */
  RAYWAVE_INPUT_ERROR = 2,  /* something given is wrong; the text says what would be right */
  RAYWAVE_DEVICE_ERROR = 3, /* the device, its driver or memory cannot do it */
  RAYWAVE_CANCELLED = 4     /* the progress callback has asked to stop */
};

enum { RAYWAVE_MOST_LASERS = 3 };

typedef struct raywave_renderer raywave_renderer;

/* Called on the thread that computes: the current step, the completed share (0 to 1), and the
 * pointer given with the callback. Returning 0 stops the computation. */
typedef int (*raywave_progress)(const char* what, double share, void* context);

/* Version of the library, "0.1.0". */
RAYWAVE_API const char* raywave_version(void);

/* What was wrong with the last call of this thread that failed; valid until its next one. */
RAYWAVE_API const char* raywave_error(void);

/* Reads a scene file. Kernels are compiled, and memory is taken, by the first render.
 *
 * overrides  keys to change, one "section.key=value" on each line ("wrp.padding=1.25"); or NULL
 * device     index ("0:1"), kind ("gpu", "cpu") or part of a name; NULL: RAYWAVE_DEVICE, else a GPU
 * renderer   receives what raywave_close frees; NULL when the call fails */
RAYWAVE_API int raywave_open(const char* file, const char* overrides, const char* device,
                             raywave_renderer** renderer);

/* The same from the text of a scene file. Objects may lack `mesh`: raywave_set_mesh gives it.
 *
 * folder  of the files that the text names; NULL: the current one */
RAYWAVE_API int raywave_open_text(const char* toml, const char* folder, const char* overrides,
                                  const char* device, raywave_renderer** renderer);

/* Frees a renderer; NULL is allowed. */
RAYWAVE_API void raywave_close(raywave_renderer* renderer);

/* Columns, rows and frames of the hologram (of each laser in colour), and the number of objects.
 * Any pointer may be NULL. */
RAYWAVE_API int raywave_size(const raywave_renderer* renderer, int* nx, int* ny, int* frames,
                             int* objects);

/* Holograms of a scene in colour, one for each laser; 1 of one wavelength.
 *
 * lasers         receives their number, at most RAYWAVE_MOST_LASERS
 * wavelengths_m  receives as many, in the order of the holograms
 * powers         receives as many: radiant powers that the lasers need for the last picture, for
 *                equal times; their sum is 1. Before the first picture they are 0
 * Any pointer may be NULL. */
RAYWAVE_API int raywave_lasers(const raywave_renderer* renderer, int* lasers, double* wavelengths_m,
                               double* powers);

/* Sets the place of an object's anchor (x, y, z in metres; the centre of its bounding box unless
 * the scene says otherwise) and its rotation about x, then y, then z, in degrees. After the first
 * render a pose that cannot be is refused here, and the object stays; before, the render refuses
 * it. */
RAYWAVE_API int raywave_set_pose(raywave_renderer* renderer, int object, const double* position_m,
                                 const double* rotation_deg);

/* Gives an object a mesh: x, y, z of each vertex; three vertices of each face, counter-clockwise
 * from outside. The next render prepares everything anew. */
RAYWAVE_API int raywave_set_mesh(raywave_renderer* renderer, int object, const double* vertices,
                                 size_t vertex_count, const uint32_t* faces, size_t face_count);

/* Sets the seed of the random phases. */
RAYWAVE_API int raywave_set_seed(raywave_renderer* renderer, uint32_t seed);

/* callback  NULL: none */
RAYWAVE_API int raywave_set_progress(raywave_renderer* renderer, raywave_progress callback,
                                     void* context);

/* Renders into `levels`: the grey levels of all frames, frame by frame, row 0 on top; in colour,
 * laser by laser.
 *
 * bytes  size of `levels`; nx ny frames lasers are needed */
RAYWAVE_API int raywave_render(raywave_renderer* renderer, uint8_t* levels, size_t bytes);

/* The same, with the complex field: real and imaginary part of each sample. Either pointer may be
 * NULL.
 *
 * floats  size of `field`; 2 nx ny frames lasers are needed */
RAYWAVE_API int raywave_render_field(raywave_renderer* renderer, uint8_t* levels, size_t bytes,
                                     float* field, size_t floats);

/* What the user should know of the last picture, one line each, a newline behind each; "" before
 * the first picture. Valid until the next render. */
RAYWAVE_API const char* raywave_notes(const raywave_renderer* renderer);

#ifdef __cplusplus
}
#endif

#endif
