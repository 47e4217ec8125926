// SPDX-License-Identifier: Apache-2.0
#include "host/common/output.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace fs = std::filesystem;

namespace {

/// Names of temporary files for the signal handler, which may only read memory and call unlink.
struct Slot {
  std::atomic<bool> is_taken{false}, is_named{false};
  std::array<char, 4096> name{};
};
std::array<Slot, 16> slots;

std::atomic<bool> is_ending{false};  // by a signal: nothing new may appear
std::atomic<int> opening{0};         // threads that open a file
std::atomic<const char*> added_at_end{nullptr};

void wait_for_end() {
  while (true) ::pause();
}

/// As open, but once a signal ends the program nothing is made any more.
int open_unless_ending(const fs::path& path, int flags) {
  ++opening;
  if (is_ending) {
    --opening;
    wait_for_end();
  }
  const int descriptor = ::open(path.c_str(), flags | O_CREAT | O_CLOEXEC, 0666);
  --opening;
  return descriptor;
}

/// A file that is removed unless it was renamed. It is locked as long as its program lives.
class Temporary {
public:
  explicit Temporary(const fs::path& path) : path_(path) {
    // Named before it is there: a signal may come between
    const auto& name = path.native();
    for (auto& slot : slots) {
      if (name.size() >= slot.name.size() || slot.is_taken.exchange(true)) continue;
      std::copy(name.c_str(), name.c_str() + name.size() + 1, slot.name.data());
      slot.is_named = true;
      slot_ = &slot;
      break;
    }
    descriptor_ = open_unless_ending(path, O_RDWR);
    if (descriptor_ >= 0) flock(descriptor_, LOCK_EX | LOCK_NB);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  ~Temporary() {
    std::error_code ignored;
    if (!is_renamed_) fs::remove(path_, ignored);
    if (slot_) {
      slot_->is_named = false;
      slot_->is_taken = false;
    }
    if (descriptor_ >= 0) ::close(descriptor_);
  }

  const fs::path& path() const { return path_; }
  void rename(const fs::path& file) {
    std::error_code error;
    fs::rename(path_, file, error);
    if (error && is_ending) wait_for_end();  // as it has been removed
    if (error)
      throw InputError(in_quotes(file.string()) + ": cannot be written: " + error.message());
    is_renamed_ = true;
  }

private:
  fs::path path_;
  int descriptor_ = -1;
  Slot* slot_ = nullptr;
  bool is_renamed_ = false;
};

/// ".hologram.1234-0.tmp.png"
fs::path temporary_beside(const fs::path& file) {
  static std::atomic<unsigned> count{0};  // for several files at a time in one process
  // No pattern of files finds it
  return file.parent_path() / ("." + file.stem().string() + "." + std::to_string(getpid()) + "-" +
                               std::to_string(count++) + ".tmp" + file.extension().string());
}

/// True for names that temporary_beside makes.
bool is_temporary(const fs::path& file) {
  const auto name = file.filename().string();
  const auto end = name.rfind(".tmp");
  if (end == std::string::npos || end == 0) return false;
  const auto begin = name.rfind('.', end - 1);
  if (begin == std::string::npos || begin + 1 == end) return false;
  const auto number = name.substr(begin + 1, end - begin - 1);
  return number.find_first_not_of("0123456789-") == std::string::npos &&
         std::count(number.begin(), number.end(), '-') == 1;
}

/// Removes the temporary files in a folder whose programs no longer live, once for each folder.
void remove_left_over(const fs::path& folder) {
  static std::mutex mutex;
  static std::set<fs::path> looked_at;
  const std::lock_guard lock(mutex);
  std::error_code error;
  if (!looked_at.insert(folder).second) return;
  for (fs::directory_iterator it(folder.empty() ? "." : folder, error), end; !error && it != end;
       it.increment(error)) {
    if (!is_temporary(it->path())) continue;
    const int descriptor = ::open(it->path().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (descriptor < 0) continue;
    std::error_code ignored;
    if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) fs::remove(it->path(), ignored);
    ::close(descriptor);
  }
}

void end_at_signal(int signal) {
  const char* more = added_at_end;
  for (const std::string_view says :
       {std::string_view("raywave: stopped; files that were whole before stay"),
        std::string_view(more ? more : ""), std::string_view("\n")})
    [[maybe_unused]] const auto written = ::write(STDERR_FILENO, says.data(), says.size());
  is_ending = true;
  // Other threads may be opening files; this one, too, and then waiting would not end
  constexpr timespec a_moment{0, 1'000'000};
  for (int i = 0; i < 50 && opening > 0; ++i) ::nanosleep(&a_moment, nullptr);
  for (const auto& slot : slots) {
    if (slot.is_named) ::unlink(slot.name.data());
  }
  raise(signal);  // again, as SA_RESETHAND has given it back its usual end
}

}  // namespace

void refuse_to_write(const std::string& name) {
  throw InputError(in_quotes(name) +
                   ": cannot be written: " + std::generic_category().message(errno));
}

void append(int descriptor, std::string_view bytes, const std::string& name) {
  while (!bytes.empty()) {
    const auto written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) refuse_to_write(name);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

void sync(int descriptor, const std::string& name) {
  if (::fsync(descriptor) != 0 && errno != EINVAL && errno != EROFS && errno != ENOTSUP)
    refuse_to_write(name);
}

OutputFile::OutputFile(const fs::path& place, const fs::path& name)
    : name_(name.string()), descriptor_(open_unless_ending(place, O_WRONLY | O_TRUNC)) {
  if (descriptor_ < 0) refuse_to_write(name_);
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void OutputFile::close() {
  sync(descriptor_, name_);
  if (::close(std::exchange(descriptor_, -1)) != 0) refuse_to_write(name_);
}

void write_whole(const fs::path& file, const std::function<void(OutputFile&)>& write) {
  write_whole_by_name(file, [&](const fs::path& temporary) {
    OutputFile output(temporary, file);
    write(output);
    output.close();
  });
}

void write_whole_by_name(const fs::path& file,
                         const std::function<void(const fs::path& temporary)>& write) {
  std::error_code error;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), error);
  if (error)
    throw InputError(in_quotes(file.parent_path().string()) +
                     ": the folder cannot be made: " + error.message());

  remove_left_over(file.parent_path());
  Temporary temporary(temporary_beside(file));
  write(temporary.path());
  temporary.rename(file);
}

HeldFolder::HeldFolder(const fs::path& folder, bool is_shared) : folder_(folder) {
  std::error_code error;
  for (auto above = folder; !above.empty() && !fs::exists(above, error);
       above = above.parent_path())
    ++made_;
  fs::create_directories(folder, error);
  if (error)
    throw InputError(in_quotes(folder.string()) +
                     ": the folder cannot be made: " + error.message());
  descriptor_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  // Some file systems have no locks
  const int lock = (is_shared ? LOCK_SH : LOCK_EX) | LOCK_NB;
  if (descriptor_ >= 0 && flock(descriptor_, lock) != 0 && errno == EWOULDBLOCK) {
    ::close(descriptor_);
    throw InputError(in_quotes(folder.string()) +
                     ": another raywave writes into this folder; wait for its end, or give another "
                     "--output");
  }
}

HeldFolder::~HeldFolder() {
  std::error_code ignored;
  for (auto above = folder_; made_ > 0; --made_, above = above.parent_path())
    fs::remove(above, ignored);  // not where something is in it
  if (descriptor_ >= 0) ::close(descriptor_);
}

void remove_temporaries_at_signals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action {};
    if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler != SIG_DFL) continue;
    action.sa_handler = end_at_signal;
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(signal, &action, nullptr);
  }
}

void add_to_end_at_signals(const char* text) { added_at_end = text; }

void write_text(const fs::path& file, const std::string& text) {
  write_whole(file, [&](OutputFile& output) { output.write(text); });
}

}  // namespace raywave
