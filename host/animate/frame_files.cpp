// SPDX-License-Identifier: Apache-2.0
#include "host/animate/frame_files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/scene/image.hpp"

namespace raywave {
namespace fs = std::filesystem;

namespace {

std::string_view text_of(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string digest_of(std::span<const std::uint8_t> bytes) {
  Digest digest;
  digest.add(text_of(bytes));
  return digest.text();
}

/// Opens a file that grows and cuts it to the bytes that are known to be whole.
int open_at(const fs::path& file, std::uint64_t bytes) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0) refuse_to_write(file.string());
  if (::ftruncate(descriptor, static_cast<off_t>(bytes)) != 0 ||
      ::lseek(descriptor, 0, SEEK_END) < 0) {
    ::close(descriptor);
    refuse_to_write(file.string());
  }
  return descriptor;
}

/// Values of a line that may be damaged: empty where there is none of this type.
std::optional<std::int64_t> integer_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number_integer()) return {};
  return found->get<std::int64_t>();
}
std::optional<std::string> text_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_string()) return {};
  return found->get<std::string>();
}

/// Calls `use` with each whole line of a report, parsed (discarded where it is no JSON), and its
/// bytes, until that returns false.
template <class Use>
void for_lines_of(const fs::path& report, Use use) {
  std::ifstream stream(report, std::ios::binary);
  for (std::string line; std::getline(stream, line) && !stream.eof();)
    if (!use(Json::parse(line, nullptr, false), line.size() + 1)) return;
}

}  // namespace

std::string FrameFiles::png_pattern(const std::string& laser) {
  return "frame_%05d" + (laser.empty() ? "" : "_" + laser) + ".png";
}

std::string FrameFiles::png_name(int hologram, const std::string& laser) {
  std::array<char, 32> number{};
  std::snprintf(number.data(), number.size(), "%05d", hologram);
  return "frame_" + std::string(number.data()) + (laser.empty() ? "" : "_" + laser) + ".png";
}

int FrameFiles::next_place() const {
  const auto each = lasers_.empty() ? 1 : static_cast<int>(lasers_.size());
  return first_.hologram * each + holograms_;
}

std::string FrameFiles::name_of(int place) const {
  if (lasers_.empty()) return png_name(place);
  const auto lasers = static_cast<int>(lasers_.size());
  return png_name(place / lasers, lasers_[static_cast<std::size_t>(place % lasers)]);
}

std::vector<std::vector<double>> FrameFiles::powers(const fs::path& folder) {
  std::vector<std::vector<double>> all;
  for_lines_of(folder / report_name, [&](const Json& line, std::uint64_t) {
    auto& powers = all.emplace_back();
    if (line.is_object() && line.contains("powers") && line["powers"].is_array())
      for (const auto& power : line["powers"])
        powers.push_back(power.is_number() ? power.get<double>() : 0);
    return true;
  });
  return all;
}

FrameFiles::FrameFiles(fs::path folder, FrameStorage storage, std::string run, glm::ivec2 size_px,
                       std::vector<std::string> lasers, FirstOfFiles first)
    : folder_(std::move(folder)),
      storage_(storage),
      run_(std::move(run)),
      size_(size_px),
      lasers_(std::move(lasers)),
      first_(first) {
  read_report();
}

FrameFiles::~FrameFiles() {
  if (report_ >= 0) ::close(report_);
  if (stream_ >= 0) ::close(stream_);
}

fs::path FrameFiles::partial_stream() const { return folder_ / "frames.raw.part"; }

void FrameFiles::read_report() {
  const auto file = folder_ / report_name;
  bool is_first = true;
  for_lines_of(file, [&](const Json& line, std::uint64_t) {
    if (!line.is_object()) return true;
    const auto picture = integer_of(line, "picture").value_or(first_.picture);
    if (std::exchange(is_first, false) && picture >= 0 && picture != first_.picture &&
        text_of(line, "run") == run_)
      throw InputError(in_quotes(file.string()) + ": this folder holds pictures from number " +
                       std::to_string(picture) + " on, and this run begins with " +
                       std::to_string(first_.picture) + "; give --pictures " +
                       std::to_string(picture) +
                       "..LAST to go on behind them, another --output, or --restart to replace "
                       "them");
    if (text_of(line, "run").value_or(run_) != run_)
      throw InputError(
          in_quotes(file.string()) +
          ": this folder holds holograms of another scene, device or version; give another "
          "--output, or --restart to replace them");
    return true;
  });

  // Nothing has been touched so far
  std::error_code error;
  if (storage_ == FrameStorage::stream && !fs::exists(partial_stream(), error))
    fs::rename(folder_ / stream_name, partial_stream(), error);  // goes on where it was finished
  std::uint64_t whole = 0;
  for_lines_of(file, [&](const Json& line, std::uint64_t bytes) {
    int count = 0;
    if (!is_whole(line, count)) return false;
    ++pictures_;
    holograms_ += count;
    whole += bytes;
    return true;
  });
  report_ = open_at(file, whole);
  if (storage_ == FrameStorage::stream)
    stream_ = open_at(partial_stream(), static_cast<std::uint64_t>(holograms_) * pixels());
}

bool FrameFiles::is_whole(const Json& line, int& count) const {
  if (!line.is_object() || integer_of(line, "picture") != next() || text_of(line, "run") != run_)
    return false;
  const auto holograms = line.find("holograms");
  if (holograms == line.end() || !holograms->is_array() || holograms->empty()) return false;
  for (const auto& hologram : *holograms) {
    const int number = next_place() + count;
    if (!hologram.is_object() || integer_of(hologram, "number") != number) return false;
    const auto digest = storage_ == FrameStorage::pngs ? digest_of_file(folder_ / name_of(number))
                                                       : digest_in_stream(holograms_ + count);
    ++count;
    if (digest.empty() || text_of(hologram, "digest") != digest) return false;
  }
  return true;
}

std::string FrameFiles::digest_in_stream(int hologram) const {
  std::ifstream stream(partial_stream(), std::ios::binary);
  std::vector<std::uint8_t> levels(pixels());
  const auto bytes = static_cast<std::streamsize>(levels.size());
  stream.seekg(static_cast<std::streamoff>(hologram) * bytes);
  stream.read(reinterpret_cast<char*>(levels.data()), bytes);
  return stream.gcount() == bytes ? digest_of(levels) : "";
}

void FrameFiles::add(std::span<const std::vector<std::uint8_t>> holograms, Json line) {
  auto list = Json::array();
  int number = next_place();
  for (const auto& levels : holograms) {
    Json entry{{"number", number}};
    if (storage_ == FrameStorage::pngs) {
      const auto name = name_of(number);
      uncompressed_png(size_.x, size_.y, levels, png_);
      write_whole(folder_ / name, [&](OutputFile& to) { to.write(text_of(png_)); });
      entry["file"] = name;
      entry["digest"] = digest_of(png_);
    } else {
      append(stream_, text_of(levels), partial_stream().string());
      entry["digest"] = digest_of(levels);
    }
    list.push_back(std::move(entry));
    ++number;
  }
  if (storage_ == FrameStorage::stream) sync(stream_, partial_stream().string());
  line["run"] = run_;
  line["holograms"] = std::move(list);
  append(report_, line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n",
         (folder_ / report_name).string());
  ++pictures_;
  holograms_ += static_cast<int>(holograms.size());
}

void FrameFiles::finish() {
  sync(report_, (folder_ / report_name).string());
  if (storage_ == FrameStorage::pngs) return;
  std::error_code error;
  fs::rename(partial_stream(), folder_ / stream_name, error);
  if (error)
    throw InputError(in_quotes((folder_ / stream_name).string()) +
                     ": cannot be written: " + error.message());
}

void FrameFiles::remove(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const auto name = entry.path().filename().string();
    // frame_00000.png, or frame_00000_638nm.png
    const auto digits_end = name.find_first_not_of("0123456789", 6);
    const bool is_frame =
        name.starts_with("frame_") && name.ends_with(".png") && digits_end > 6 &&
        (digits_end == name.size() - 4 || (name[digits_end] == '_' && name.ends_with("nm.png")));
    if (is_frame || name == report_name || name == stream_name || name == "frames.raw.part")
      files.push_back(entry.path());
  }
  for (const auto& file : files) {
    fs::remove(file, error);
    if (error)
      throw InputError(in_quotes(file.string()) + ": cannot be removed: " + error.message());
  }
}

WriteQueue::WriteQueue(std::size_t longest) : longest_(longest), thread_([this] { work(); }) {}

WriteQueue::~WriteQueue() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void WriteQueue::push(std::function<void()> job) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return failure_ || jobs_.size() <= longest_; });
  require_success();
  jobs_.push_back(std::move(job));
  changed_.notify_all();
}

void WriteQueue::finish() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return failure_ || jobs_.empty(); });
  require_success();
}

void WriteQueue::require_success() {
  if (failure_) std::rethrow_exception(failure_);
}

void WriteQueue::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return ends_ || (!failure_ && !jobs_.empty()); });
    if (ends_) return;
    auto& job = jobs_.front();  // stays in its place while others are added behind it
    lock.unlock();
    std::exception_ptr failure;
    try {
      job();
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    jobs_.pop_front();
    failure_ = failure;
    changed_.notify_all();
  }
}

}  // namespace raywave
