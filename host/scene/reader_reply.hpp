// SPDX-License-Identifier: Apache-2.0
/// Replies of the reader processes, checked like any other input: a reader that ran wild may have
/// sent them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "host/common/error.hpp"
#include "host/scene/read_data.hpp"

namespace raywave {

// The pipe from a reader process to the process that wants the file.

/// The first byte of a reply: a result follows, or a message that says why there is none.
enum class Verdict : char { done, failed };

/// One end of the pipe. Does not own the descriptor.
///
/// throws  std::runtime_error when the other side is gone
class ReaderPipe {
public:
  explicit ReaderPipe(int descriptor) : descriptor_(descriptor) {}

  void write(std::span<const std::byte> bytes);
  void read(std::span<std::byte> bytes);

  /// Of a type without pointers.
  template <class T>
  void write_value(const T& value) {
    write(std::as_bytes(std::span(&value, 1)));
  }
  template <class T>
  void read_value(T& value) {
    read(std::as_writable_bytes(std::span(&value, 1)));
  }

  template <class T>
  void write_vector(const std::vector<T>& values) {
    write_value(std::uint64_t{values.size()});
    write(std::as_bytes(std::span(values)));
  }

  /// throws  std::runtime_error also for more than `max_count` values
  template <class T>
  void read_vector(std::vector<T>& values, std::uint64_t max_count) {
    std::uint64_t count = 0;
    read_value(count);
    if (count > max_count)
      throw std::runtime_error("more than was agreed on comes through the pipe");
    // A count is only a claim until some of it has come.
    values.resize(std::min<std::uint64_t>(count, (std::size_t{1} << 20) / sizeof(T)));
    read(std::as_writable_bytes(std::span(values)));
    const std::size_t first = values.size();
    values.resize(count);
    read(std::as_writable_bytes(std::span(values).subspan(first)));
  }

private:
  int descriptor_;
};

// Also against small files that repeat one mesh without end
constexpr std::size_t most_triangles_of_file = 100'000'000;
constexpr std::size_t most_vertices_of_file = 3 * most_triangles_of_file;
constexpr int largest_picture_side = 65536;
constexpr std::size_t most_materials_of_file = 65536, most_pictures_of_file = 4096;
constexpr std::size_t most_picture_bytes = std::size_t{2} << 30;  // of all pictures in a file
constexpr std::size_t most_cameras_of_file = 1024, most_lights_of_file = 4096;
constexpr std::size_t most_notes_of_file = 64, longest_text = 4096;
constexpr std::size_t most_channels_of_reply = 8;
constexpr std::size_t most_nodes_of_file = 1'000'000, most_animations_of_file = 4096;
constexpr std::size_t most_moves_of_file = 100'000, most_keys_of_file = 20'000'000;
constexpr std::size_t most_joints_of_skin = 65536, most_influences = 32;  // joints of a vertex
constexpr std::size_t most_targets_of_mesh = 4096;
constexpr std::size_t most_deforming_of_file = 100'000'000;  // vertices, of all morph targets, too

/// throws  InputError, in the reader's words, for more than `most`
inline void require_at_most(std::size_t count, std::size_t most, std::string_view what) {
  if (count > most) throw InputError("more than " + std::to_string(most) + " " + std::string(what));
}

void send(ReaderPipe& pipe, const Mesh& mesh);
void send(ReaderPipe& pipe, const GltfSet& set);
void send(ReaderPipe& pipe, const GltfMotion& motion);
void send(ReaderPipe& pipe, const Image& image);
void send(ReaderPipe& pipe, const std::vector<Image>& channels);

/// All throw std::runtime_error when the pipe closes early or brings something that no reader may
/// return: indices of vertices, materials, pictures or nodes that are not there, numbers that are
/// not finite or out of their range, normals neither of unit length nor zero, vectors of unequal
/// length, sizes beyond the limits above.
Mesh receive_mesh(ReaderPipe& pipe);
GltfSet receive_gltf_set(ReaderPipe& pipe);
GltfMotion receive_gltf_motion(ReaderPipe& pipe);
Image receive_image(ReaderPipe& pipe);
std::vector<Image> receive_channels(ReaderPipe& pipe);

}  // namespace raywave
