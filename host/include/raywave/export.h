/* SPDX-License-Identifier: Apache-2.0 */
/* What the shared library shows: everything else of it is hidden. */
#ifndef RAYWAVE_EXPORT_H
#define RAYWAVE_EXPORT_H

#if defined(__GNUC__)
#define RAYWAVE_API __attribute__((visibility("default")))
#else
#define RAYWAVE_API
#endif

#endif
