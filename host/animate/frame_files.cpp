// SPDX-License-Identifier: Apache-2.0
#include "host/animate/frame_files.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
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
#include "host/plan/message_text.hpp"
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

bool is_part_report(const std::string& name) {
  return name.starts_with("report_") && name.ends_with(".jsonl");
}

std::vector<fs::path> part_reports(const fs::path& folder) {
  std::vector<fs::path> reports;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (is_part_report(entry.path().filename().string())) reports.push_back(entry.path());
  return reports;
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

std::string line_of(const Json& line) {
  return line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

/// Calls `use` with each whole line of a report, discarded where it is no JSON.
template <class Use>
void for_lines_of(const fs::path& report, Use use) {
  std::ifstream stream(report, std::ios::binary);
  for (std::string line; std::getline(stream, line) && !stream.eof();)
    use(Json::parse(line, nullptr, false));
}

}  // namespace

std::string FrameFiles::png_pattern(const std::string& laser) {
  return "frame_%05d" + (laser.empty() ? "" : "_" + laser) + ".png";
}

std::string FrameFiles::png_name(int hologram, const std::string& laser) {
  return format("frame_%05d", hologram) + (laser.empty() ? "" : "_" + laser) + ".png";
}

std::string FrameFiles::tile_name(int hologram) { return format(tile_pattern, hologram); }

std::string FrameFiles::name_of(int place) const {
  if (storage_ == FrameStorage::tiles) return tile_name(place);
  if (lasers_.empty()) return png_name(place);
  return png_name(place / lasers(), lasers_[static_cast<std::size_t>(place % lasers())]);
}

std::vector<std::vector<double>> FrameFiles::powers(const fs::path& folder) {
  std::vector<std::vector<double>> all;
  for_lines_of(folder / report_name, [&](const Json& line) {
    auto& powers = all.emplace_back();
    if (line.is_object() && line.contains("powers") && line["powers"].is_array())
      for (const auto& power : line["powers"])
        powers.push_back(power.is_number() ? power.get<double>() : 0);
  });
  return all;
}

FrameFiles::FrameFiles(fs::path folder, FrameStorage storage, std::string run, Schedule schedule,
                       glm::ivec2 size_px, std::vector<std::string> lasers,
                       std::optional<PictureRange> wanted, bool is_helper)
    : folder_(std::move(folder)),
      storage_(storage),
      run_(std::move(run)),
      schedule_(schedule),
      size_(size_px),
      lasers_(std::move(lasers)),
      wanted_(wanted.value_or(PictureRange{0, schedule.pictures()})),
      is_helper_(is_helper) {
  if (!is_helper_) read_reports();
  for (int picture = wanted_.first; picture < wanted_.end; ++picture)
    if (!has(picture)) missing_.push_back(picture);
  if (!missing_.empty()) open_to_add();
}

FrameFiles::~FrameFiles() {
  if (report_ >= 0) ::close(report_);
  if (stream_ >= 0) ::close(stream_);
}

fs::path FrameFiles::partial_stream() const { return folder_ / "frames.raw.part"; }

fs::path FrameFiles::own_report() const {
  if (!is_part()) return folder_ / report_name;
  return folder_ / format("report_%05d_%05d.jsonl", wanted_.first, wanted_.end - 1);
}

void FrameFiles::read_reports() {
  auto reports = part_reports(folder_);
  reports.push_back(folder_ / report_name);
  for (const auto& file : reports)
    for_lines_of(file, [&](const Json& line) {
      if (!line.is_object()) return;
      const auto run = text_of(line, "run");
      if (run && *run != run_)
        throw InputError(
            in_quotes(file.string()) +
            ": this folder holds holograms of another scene, device or version, or of other --set" +
            (storage_ == FrameStorage::tiles
                 ? " or --preset; repeat these, or give another --output"
                 : ", --preset or --stream; repeat these, give another --output, or --restart to "
                   "replace all of them"));
      const auto picture = integer_of(line, word());
      if (!run || !picture || *picture < wanted_.first || *picture >= wanted_.end) return;
      const auto number = static_cast<int>(*picture);
      if (!has(number) && is_whole(number, line)) lines_.emplace(number, line_of(line));
    });
}

void FrameFiles::open_report() {
  if (is_helper_) {
    report_ = ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0);
    return;
  }
  const auto file = own_report();
  report_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (report_ < 0) refuse_to_write(file.string());
  // Some file systems have no locks
  if (::flock(report_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    throw InputError(in_quotes(file.string()) + ": another raywave makes these " + word() +
                     "s; wait for its end");
  // The end of a line that was cut off
  char last = 0;
  const auto bytes = ::lseek(report_, 0, SEEK_END);
  if (bytes > 0 && ::pread(report_, &last, 1, bytes - 1) == 1 && last != '\n')
    append(report_, "\n", file.string());
}

void FrameFiles::open_to_add() {
  open_report();
  if (storage_ != FrameStorage::stream) return;
  std::error_code error;
  if (!fs::exists(partial_stream(), error))
    fs::rename(folder_ / stream_name, partial_stream(), error);  // goes on where it was finished
  stream_ = ::open(partial_stream().c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (stream_ < 0) refuse_to_write(partial_stream().string());
}

bool FrameFiles::is_whole(int picture, const Json& line) const {
  const auto holograms = line.find("holograms");
  const auto count = static_cast<std::size_t>(schedule_.count_of(picture) * lasers());
  if (holograms == line.end() || !holograms->is_array() || holograms->size() != count) return false;
  int place = schedule_.first_of(picture) * lasers();
  for (const auto& hologram : *holograms) {
    if (!hologram.is_object() || integer_of(hologram, "number") != place) return false;
    const auto digest = storage_ == FrameStorage::stream ? digest_in_stream(place)
                                                         : digest_of_file(folder_ / name_of(place));
    if (digest.empty() || text_of(hologram, "digest") != digest) return false;
    ++place;
  }
  return true;
}

std::string FrameFiles::digest_in_stream(int place) const {
  std::error_code error;
  const bool is_partial = fs::exists(partial_stream(), error);
  std::ifstream stream(is_partial ? partial_stream() : folder_ / stream_name, std::ios::binary);
  std::vector<std::uint8_t> levels(pixels());
  const auto bytes = static_cast<std::streamsize>(levels.size());
  stream.seekg(static_cast<std::streamoff>(place) * bytes);
  stream.read(reinterpret_cast<char*>(levels.data()), bytes);
  return stream.gcount() == bytes ? digest_of(levels) : "";
}

void FrameFiles::add(int picture, std::span<const std::vector<std::uint8_t>> holograms, Json line) {
  auto list = Json::array();
  int place = schedule_.first_of(picture) * lasers();
  if (stream_ >= 0 &&
      ::lseek(stream_, static_cast<off_t>(place) * static_cast<off_t>(pixels()), SEEK_SET) < 0)
    refuse_to_write(partial_stream().string());
  for (const auto& levels : holograms) {
    Json entry{{"number", place}};
    if (storage_ != FrameStorage::stream) {
      const auto name = name_of(place);
      uncompressed_png(size_.x, size_.y, levels, png_);
      write_whole(folder_ / name, [&](OutputFile& to) { to.write(text_of(png_)); });
      entry["file"] = name;
      entry["digest"] = digest_of(png_);
    } else {
      append(stream_, text_of(levels), partial_stream().string());
      entry["digest"] = digest_of(levels);
    }
    list.push_back(std::move(entry));
    ++place;
  }
  if (storage_ == FrameStorage::stream) sync(stream_, partial_stream().string());
  line["run"] = run_;
  line["holograms"] = std::move(list);
  auto text = line_of(line);
  append(report_, text, own_report().string());
  lines_.emplace(picture, std::move(text));
}

std::optional<int> FrameFiles::next() {
  int picture = 0;
  if (!is_helper_)
    return taken_ < missing_.size() ? std::optional(missing_[taken_++]) : std::nullopt;
  // Helpers share the place in the file
  if (::read(STDIN_FILENO, &picture, sizeof picture) != sizeof picture) return {};
  if (picture < wanted_.first || picture >= wanted_.end)
    throw InputError("standard input is no queue of another raywave's " + std::string(word()) +
                     "s");
  return picture;
}

Json FrameFiles::add_line(const std::string& text) {
  auto line = Json::parse(text, nullptr, false);
  const auto picture = line.is_object() ? integer_of(line, word()) : std::nullopt;
  if (!picture || text_of(line, "run") != run_)
    throw InputError(std::string("it plans these ") + word() + "s otherwise than the first device");
  auto kept = line;
  kept.erase(times_key);
  append(report_, line_of(kept), own_report().string());
  lines_.emplace(static_cast<int>(*picture), line_of(kept));
  return line;
}

void FrameFiles::finish() {
  if (report_ >= 0) sync(report_, own_report().string());
  if (is_part()) return;
  std::error_code error;
  if (report_ >= 0 || !part_reports(folder_).empty())
    write_whole(folder_ / report_name, [&](OutputFile& to) {
      for (const auto& [picture, line] : lines_) to.write(line);
    });
  for (const auto& report : part_reports(folder_)) fs::remove(report, error);
  fs::remove(folder_ / shared_name, error);
  if (storage_ != FrameStorage::stream || !fs::exists(partial_stream(), error)) return;
  // An earlier run's may have been longer
  fs::resize_file(partial_stream(),
                  static_cast<std::uintmax_t>(schedule_.holograms() * lasers()) * pixels(), error);
  if (!error) fs::rename(partial_stream(), folder_ / stream_name, error);
  if (error)
    throw InputError(in_quotes((folder_ / stream_name).string()) +
                     ": cannot be written: " + error.message());
}

std::map<std::string, std::string> FrameFiles::digests(const fs::path& folder) {
  auto reports = part_reports(folder);
  reports.push_back(folder / report_name);
  std::map<std::string, std::string> all;
  for (const auto& report : reports)
    for_lines_of(report, [&](const Json& line) {
      const auto holograms = line.is_object() ? line.find("holograms") : line.end();
      if (holograms == line.end() || !holograms->is_array()) return;
      for (const auto& hologram : *holograms)
        if (hologram.is_object())
          all[text_of(hologram, "file").value_or("")] = text_of(hologram, "digest").value_or("");
    });
  return all;
}

std::vector<std::string> FrameFiles::notes(const fs::path& folder) {
  auto reports = part_reports(folder);
  reports.push_back(folder / report_name);
  std::vector<std::string> all;
  for (const auto& report : reports)
    for_lines_of(report, [&](const Json& line) {
      for (const auto& note : line.is_object() ? line.value("notes", Json::array()) : Json::array())
        if (note.is_string()) add_lines(all, {note.get<std::string>()});
    });
  return all;
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
    if (is_frame || name == report_name || is_part_report(name) || name == shared_name ||
        name == stream_name || name == "frames.raw.part")
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
