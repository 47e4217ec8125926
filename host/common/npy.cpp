// SPDX-License-Identifier: Apache-2.0
#include "host/common/npy.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace {

static_assert(std::endian::native == std::endian::little,
              "samples go to and from the file as they lie in memory");

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr std::uint32_t kMaxHeaderBytes = 4096;
// The product of all limits times 16 bytes fits into 64 bits
constexpr std::uint64_t kMaxSide = 1 << 20, kMaxFrames = 1 << 16;

/// Parser of the dictionary in the header, from left to right. Each `take...` skips blanks and
/// consumes its item when it is there.
class HeaderText {
public:
  explicit HeaderText(std::string_view text) : rest_(text) {}

  bool take(std::string_view token) {
    skip_blanks();
    if (!rest_.starts_with(token)) return false;
    rest_.remove_prefix(token.size());
    return true;
  }

  std::optional<std::string_view> take_quoted() {
    skip_blanks();
    const auto end = rest_.empty() || (rest_[0] != '\'' && rest_[0] != '"')
                         ? std::string_view::npos
                         : rest_.find(rest_[0], 1);
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view text = rest_.substr(1, end - 1);
    rest_.remove_prefix(end + 1);
    return text;
  }

  std::optional<std::uint64_t> take_number() {
    skip_blanks();
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), number);
    if (error != std::errc()) return std::nullopt;
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    return number;
  }

  /// Elements separated by commas; a comma after the last one is allowed.
  template <class TakeElement>
  bool take_list(std::string_view open, std::string_view close, TakeElement take_element) {
    if (!take(open)) return false;
    while (!take(close)) {
      if (!take_element()) return false;
      if (!take(",")) return take(close);
    }
    return true;
  }

  bool at_end() {
    skip_blanks();
    return rest_.empty();
  }

private:
  void skip_blanks() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \n"), rest_.size()));
  }
  std::string_view rest_;
};

struct Header {
  std::optional<std::string_view> descr;
  std::optional<bool> fortran_order;
  std::optional<std::vector<std::uint64_t>> shape;
};

/// Parses {'descr': '<c8', 'fortran_order': False, 'shape': (1080, 1920), }: each key once, in any
/// order.
std::optional<Header> parse_header(std::string_view text) {
  HeaderText in(text);
  Header header;
  const auto take_shape = [&] {
    header.shape.emplace();
    return in.take_list("(", ")", [&] {
      const auto side = in.take_number();
      if (side) header.shape->push_back(*side);
      return side.has_value();
    });
  };
  const auto take_entry = [&] {
    const auto key = in.take_quoted();
    if (!key || !in.take(":")) return false;
    if (*key == "descr" && !header.descr) return (header.descr = in.take_quoted()).has_value();
    if (*key == "shape" && !header.shape) return take_shape();
    if (*key != "fortran_order" || header.fortran_order) return false;
    header.fortran_order = in.take("True");
    return *header.fortran_order || in.take("False");
  };
  const bool complete = in.take_list("{", "}", take_entry) && in.at_end() && header.descr &&
                        header.fortran_order && header.shape;
  return complete ? std::optional(header) : std::nullopt;
}

/// Reads the text of the header; the stream then stands at the first sample.
std::optional<std::string> read_header_text(std::ifstream& stream) {
  std::array<char, 8> start{};  // magic, major and minor version
  stream.read(start.data(), start.size());
  const int major = start[6], minor = start[7];
  if (!stream || !std::string_view(start.data(), start.size()).starts_with(kMagic) || major < 1 ||
      major > 3 || minor != 0)
    return std::nullopt;
  std::uint32_t length = 0;  // little-endian, of 2 bytes in version 1 and 4 bytes later
  stream.read(reinterpret_cast<char*>(&length), major == 1 ? 2 : 4);
  if (!stream || length > kMaxHeaderBytes) return std::nullopt;
  std::string text(length, ' ');
  stream.read(text.data(), length);
  return stream ? std::optional(text) : std::nullopt;
}

/// Reads all numbers of a type.
template <class Number>
bool read_numbers(std::ifstream& stream, std::vector<double>& numbers) {
  std::vector<Number> all(numbers.size());
  stream.read(reinterpret_cast<char*>(all.data()),
              static_cast<std::streamsize>(all.size() * sizeof(Number)));
  numbers.assign(all.begin(), all.end());
  return bool{stream};
}

/// The reader of a type of real numbers; null: there is none.
auto reader_of(std::string_view type) -> bool (*)(std::ifstream&, std::vector<double>&) {
  if (type == "<f8") return read_numbers<double>;
  if (type == "<f4") return read_numbers<float>;
  if (type == "|u1") return read_numbers<std::uint8_t>;
  if (type == "<u2") return read_numbers<std::uint16_t>;
  if (type == "<i4") return read_numbers<std::int32_t>;
  return type == "<i8" ? read_numbers<std::int64_t> : nullptr;
}

/// Reads row by row, so that a file of doubles needs no second copy in memory.
template <class Sample>
bool read_samples(std::ifstream& stream, int row_length,
                  std::vector<std::complex<float>>& samples) {
  std::vector<Sample> row(static_cast<std::size_t>(row_length));
  for (auto out = samples.begin(); out != samples.end(); out += row_length) {
    stream.read(reinterpret_cast<char*>(row.data()),
                static_cast<std::streamsize>(row.size() * sizeof(Sample)));
    if (!stream) return false;
    std::transform(row.begin(), row.end(), out,
                   [](const Sample& s) { return std::complex<float>(s); });
  }
  return true;
}

/// frames_text  the beginning of the shape: "4, ", or nothing
template <class T>
void save_array(const std::filesystem::path& file, const std::string& type,
                const std::string& frames_text, int nx, int ny, int frames,
                std::span<const T> samples) {
  if (nx < 1 || ny < 1 || frames < 1 || samples.size() != std::size_t{1} * nx * ny * frames)
    throw std::invalid_argument("save_npy: the samples do not fill nx * ny * frames");
  const std::string shape = frames_text + std::to_string(ny) + ", " + std::to_string(nx);
  std::string header =
      "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
  constexpr std::size_t start_bytes = 10,
                        // Magic, version, length; samples begin at a multiple of 64, as NumPy
      // writes them
      alignment = 64;
  header.append(alignment - 1 - (start_bytes + header.size()) % alignment, ' ').push_back('\n');

  write_whole(file, [&](OutputFile& output) {
    const auto length = static_cast<std::uint16_t>(header.size());
    output.write(kMagic);
    output.write(std::string_view("\1\0", 2));
    output.write(&length, sizeof length);
    output.write(header);
    output.write(samples.data(), samples.size_bytes());
  });
}

}  // namespace

FieldStack load_npy(const std::filesystem::path& file) {
  const std::string name = in_quotes(file.string());
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    throw InputError(name + ": there is no such file");
  const std::uintmax_t file_bytes = std::filesystem::file_size(file, error);
  std::ifstream stream(file, std::ios::binary);
  if (error || !stream) throw InputError(name + ": cannot be read");

  const auto text = read_header_text(stream);
  const auto header = text ? parse_header(*text) : std::nullopt;
  if (!header) throw InputError(name + ": is no .npy file of format 1.0 to 3.0");
  const bool is_double = *header->descr == "<c16";
  if ((!is_double && *header->descr != "<c8") || *header->fortran_order)
    throw InputError(
        name +
        ": must hold complex64 or complex128 samples, little-endian, in C order; its type is " +
        in_quotes(*header->descr) + (*header->fortran_order ? " in Fortran order" : ""));

  std::vector<std::uint64_t> shape = *header->shape;
  if (shape.size() == 2) shape.insert(shape.begin(), 1);
  if (shape.size() != 3)
    throw InputError(name + ": must have shape (ny, nx) or (frames, ny, nx), and has " +
                     std::to_string(shape.size()) + " dimensions");
  if (std::find(shape.begin(), shape.end(), 0) != shape.end() || shape[0] > kMaxFrames ||
      shape[1] > kMaxSide || shape[2] > kMaxSide)
    throw InputError(name + ": every side must be 1 to " + std::to_string(kMaxSide) +
                     ", and frames 1 to " + std::to_string(kMaxFrames));
  const std::uint64_t count = shape[0] * shape[1] * shape[2], bytes = count * (is_double ? 16 : 8);
  if (const auto start = static_cast<std::uintmax_t>(stream.tellg()); file_bytes - start != bytes)
    throw InputError(name + ": its shape asks for " + std::to_string(bytes) +
                     " bytes of samples, and the file has " + std::to_string(file_bytes - start));

  FieldStack field{
      static_cast<int>(shape[2]), static_cast<int>(shape[1]), static_cast<int>(shape[0]), {}};
  field.samples.resize(count);
  const bool whole = is_double ? read_samples<std::complex<double>>(stream, field.nx, field.samples)
                               : read_samples<std::complex<float>>(stream, field.nx, field.samples);
  if (!whole) throw InputError(name + ": cannot be read to its end");
  const auto bad =
      std::find_if(field.samples.begin(), field.samples.end(), [](const std::complex<float>& s) {
        return !std::isfinite(s.real()) || !std::isfinite(s.imag());
      });
  if (bad != field.samples.end())
    throw InputError(name + ": sample " + std::to_string(bad - field.samples.begin()) +
                     " is NaN or beyond float");
  return field;
}

std::vector<std::vector<double>> load_npy_rows(const std::filesystem::path& file) {
  const std::string name = one_line(file.string());
  std::ifstream stream(file, std::ios::binary);
  const auto text = read_header_text(stream);
  const auto header = text ? parse_header(*text) : std::nullopt;
  if (!header) throw InputError(name + ": is no .npy file of format 1.0 to 3.0");
  const auto read = reader_of(*header->descr);
  auto shape = *header->shape;
  if (shape.size() == 1) shape.push_back(1);
  if (!read || shape.size() != 2 || shape[0] > kMaxSide || shape[1] > kMaxSide ||
      shape[0] * shape[1] > kMaxSide)
    throw InputError(name + ": must hold real numbers of shape (n) or (n, m); its type is " +
                     in_quotes(*header->descr) + ", and it has " +
                     std::to_string(header->shape->size()) + " dimensions");
  std::vector<double> numbers(shape[0] * shape[1]);
  if (!read(stream, numbers)) throw InputError(name + ": is cut short");
  std::vector<std::vector<double>> rows(shape[0]);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!std::isfinite(numbers[i])) throw InputError(name + ": holds NaN or infinity");
    rows[*header->fortran_order ? i % shape[0] : i / shape[1]].push_back(numbers[i]);
  }
  return rows;
}

void save_npy(const std::filesystem::path& file, int nx, int ny, int frames,
              std::span<const std::uint8_t> numbers) {
  save_array(file, "|u1", std::to_string(frames) + ", ", nx, ny, frames, numbers);
}

void save_npy(const std::filesystem::path& file, int nx, int ny, int frames,
              std::span<const std::uint16_t> numbers) {
  save_array(file, "<u2", std::to_string(frames) + ", ", nx, ny, frames, numbers);
}

void save_npy(const std::filesystem::path& file, int nx, int ny, int frames,
              std::span<const std::complex<float>> samples) {
  save_array(file, "<c8", frames > 1 ? std::to_string(frames) + ", " : "", nx, ny, frames, samples);
}

}  // namespace raywave
