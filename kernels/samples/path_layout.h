// SPDX-License-Identifier: Apache-2.0
// Sizes of what is fitted to a path over mirrors and through glass (paths.cl), for the device and,
// as C++, for host/trace/specular_paths.cpp.
#ifndef RAYWAVE_PATH_LAYOUT_H
#define RAYWAVE_PATH_LAYOUT_H

// Places on the window to which a path is followed: Gauss-Legendre nodes, PATH_NODES_ALONG per side
#define PATH_NODES_ALONG 4
#define PATH_NODES (PATH_NODES_ALONG * PATH_NODES_ALONG)

// Terms x^i y^j of the rest of a path, by total degree from 2 on and by falling i; x and y in half
// sides of the window
#define PATH_DEGREE 5
// Terms of the amplitude, from degree 0 on
#define PATH_AMPLITUDE_DEGREE 2

// The table of fits: x, then y, of the nodes; PATH_TERMS rows that make a term of the rest's
// derivatives along x at all nodes, and along y; PATH_AMPLITUDE_TERMS rows that make a term of the
// amplitude at all nodes.
#define PATH_FIT_ROWS (2 * PATH_NODES)
#define PATH_FIT_AMPLITUDE (PATH_FIT_ROWS + 2 * PATH_NODES * PATH_TERMS)
#define PATH_FIT_SIZE (PATH_FIT_AMPLITUDE + PATH_NODES * PATH_AMPLITUDE_TERMS)

#endif
