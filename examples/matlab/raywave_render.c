/* SPDX-License-Identifier: Apache-2.0 */
/* A MEX function for MATLAB and Octave over the C interface:
 *
 *     levels = raywave_render('scene.toml')
 *     levels = raywave_render('scene.toml', overrides)
 *     levels = raywave_render('scene.toml', overrides, object, position, rotation)
 *
 * levels     uint8, (ny, nx) or (ny, nx, frames); row 1 on top; of three lasers, the frames
 *            of each come one after another
 * overrides  keys to change, one "section.key=value" on each line
 * object     counted from 0, with its position in metres and its rotation in degrees
 *
 * Octave:  mkoctfile --mex -IPREFIX/include -LPREFIX/lib -lraywave raywave_render.c
 * MATLAB:  mex -IPREFIX/include -LPREFIX/lib -lraywave raywave_render.c */
#include <raywave/raywave.h>

#include "mex.h"

static const double* three_numbers(const mxArray* array) {
  if (!mxIsDouble(array) || mxGetNumberOfElements(array) != 3)
    mexErrMsgIdAndTxt("raywave:input", "position and rotation are three numbers each");
  return mxGetPr(array);
}

/* Leaves the function with raywave's own text. */
static void fail(raywave_renderer* renderer) {
  raywave_close(renderer);
  mexErrMsgIdAndTxt("raywave:render", "%s", raywave_error());
}

void mexFunction(int outputs, mxArray* output[], int inputs, const mxArray* input[]) {
  raywave_renderer* renderer = NULL;
  const double* position = NULL;
  const double* rotation = NULL;
  char* file = NULL;
  char* overrides = NULL;
  uint8_t* rows = NULL;
  uint8_t* columns = NULL;
  int nx = 0, ny = 0, frames = 0, lasers = 0, x = 0, y = 0, frame = 0, status = 0;
  size_t size = 0;
  mwSize shape[3];

  if (outputs > 1 || (inputs != 1 && inputs != 2 && inputs != 5) || !mxIsChar(input[0]) ||
      (inputs > 1 && !mxIsChar(input[1])))
    mexErrMsgIdAndTxt("raywave:input",
                      "levels = raywave_render(scene[, overrides[, object, position, rotation]])");
  if (inputs == 5) position = three_numbers(input[3]), rotation = three_numbers(input[4]);
  file = mxArrayToString(input[0]);
  if (inputs > 1) overrides = mxArrayToString(input[1]);
  status = raywave_open(file, overrides, NULL, &renderer);
  mxFree(file);
  if (overrides) mxFree(overrides);
  if (status != RAYWAVE_OK) fail(NULL);
  if (inputs == 5 &&
      raywave_set_pose(renderer, (int)mxGetScalar(input[2]), position, rotation) != RAYWAVE_OK)
    fail(renderer);

  raywave_size(renderer, &nx, &ny, &frames, NULL);
  raywave_lasers(renderer, &lasers, NULL, NULL);
  frames *= lasers;
  size = (size_t)nx * (size_t)ny * (size_t)frames;
  rows = mxMalloc(size);
  if (raywave_render(renderer, rows, size) != RAYWAVE_OK) {
    mxFree(rows);
    fail(renderer);
  }
  raywave_close(renderer);

  /* MATLAB stores columns one after the other. */
  shape[0] = (mwSize)ny;
  shape[1] = (mwSize)nx;
  shape[2] = (mwSize)frames;
  output[0] = mxCreateNumericArray(frames == 1 ? 2 : 3, shape, mxUINT8_CLASS, mxREAL);
  columns = (uint8_t*)mxGetData(output[0]);
  for (frame = 0; frame < frames; ++frame)
    for (y = 0; y < ny; ++y)
      for (x = 0; x < nx; ++x)
        columns[((size_t)frame * nx + x) * ny + y] = rows[((size_t)frame * ny + y) * nx + x];
  mxFree(rows);
}
