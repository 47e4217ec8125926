// SPDX-License-Identifier: Apache-2.0
/// Replies of the reader processes, checked like any other input: a reader that ran wild may have
/// sent them.
#pragma once

#include "host/scene/image.hpp"
#include "host/scene/mesh.hpp"
#include "host/scene/reader_pipe.hpp"

namespace raywave {

// Also against small files that repeat one mesh without end
constexpr std::size_t most_triangles_of_file = 100'000'000;
constexpr std::size_t most_vertices_of_file = 3 * most_triangles_of_file;
constexpr int largest_picture_side = 65536;

void send(ReaderPipe& pipe, const Mesh& mesh);
void send(ReaderPipe& pipe, const Image& image);

/// Both throw std::runtime_error when the pipe closes early or brings something that no reader may
/// return: indices of vertices that are not there, numbers that are not finite, normals neither of
/// unit length nor zero, vectors of unequal length, sizes beyond the limits above.
Mesh receive_mesh(ReaderPipe& pipe);
Image receive_image(ReaderPipe& pipe);

}  // namespace raywave
