// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/mesh_text.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <utility>

#include "host/common/error.hpp"

namespace raywave {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\0'; }

}  // namespace

MappedFile::MappedFile(const std::filesystem::path& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat about {};
  if (descriptor >= 0 && fstat(descriptor, &about) == 0 && about.st_size > 0) {
    const auto size = static_cast<std::size_t>(about.st_size);
    void* all = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, descriptor, 0);
    if (all != MAP_FAILED) bytes_ = {static_cast<const char*>(all), size};
  }
  if (descriptor >= 0) close(descriptor);
  if (descriptor < 0 || (about.st_size > 0 && bytes_.empty()))
    throw InputError("it cannot be opened");
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) munmap(const_cast<char*>(bytes_.data()), bytes_.size());
}

bool is_number(std::string_view word, double& value) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const char* last = word.data() + word.size();
  const auto found = std::from_chars(word.data(), last, value);
  if (found.ec == std::errc::result_out_of_range && found.ptr == last) {
    const bool is_small = word.find("e-") != word.npos || word.find("E-") != word.npos;
    value = is_small ? 0 : std::numeric_limits<double>::infinity();
    return true;
  }
  if (found.ec != std::errc()) return false;
  if (found.ptr == last) return true;
  if ((*found.ptr != 'd' && *found.ptr != 'D') || word.size() > 64) return false;
  std::string other(word);
  other[static_cast<std::size_t>(found.ptr - word.data())] = 'e';
  return is_number(other, value);
}

std::string word_in_quotes(std::string_view word) {
  return '"' + std::string(word.substr(0, 40)) + '"';
}

std::string digits_of(double value) {
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 6);
  return {text.data(), end.ptr};
}

std::string lower(std::string_view word) {
  std::string text(word);
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

LineScanner::LineScanner(std::string_view text, std::string file, bool joins)
    : text_(text), file_(std::move(file)), joins_(joins) {
  if (text_.starts_with("\xff\xfe") || text_.starts_with("\xfe\xff"))
    throw InputError((file_.empty() ? "" : file_ + ": ") +
                     "is UTF-16 text; save it as UTF-8 or ASCII");
  if (text_.starts_with("\xef\xbb\xbf")) next_ = 3;
}

void LineScanner::find_end() {
  for (end_ = at_; end_ < text_.size(); ++end_)
    if (text_[end_] == '\n' || text_[end_] == '\r') break;
  next_ = std::min(end_ + 1, text_.size());
  if (end_ + 1 < text_.size() && text_[end_] == '\r' && text_[end_ + 1] == '\n') ++next_;
}

bool LineScanner::next_line() {
  line_ += more_;
  more_ = 0;
  while (joins_ && line_ > 0 && end_ > at_ && text_[end_ - 1] == '\\') {  // not all of it was read
    at_ = next_;
    find_end();
    ++line_;
  }
  if (next_ >= text_.size()) return false;
  begin_ = at_ = next_;
  ++line_;
  find_end();
  return true;
}

std::string_view LineScanner::word() {
  for (;;) {
    while (at_ < end_ && is_blank(text_[at_])) ++at_;
    if (!joins_ || at_ + 1 != end_ || text_[at_] != '\\') break;
    at_ = next_;
    find_end();
    ++more_;
  }
  const auto first = at_;
  if (first < end_ && text_[first] == '#') at_ = end_;
  if (at_ == end_) return {};
  while (at_ < end_ && !is_blank(text_[at_])) ++at_;
  if (joins_ && at_ == end_ && text_[at_ - 1] == '\\') --at_;
  return text_.substr(first, at_ - first);
}

std::string_view LineScanner::rest() {
  auto all = text_.substr(at_, end_ - at_);
  at_ = end_;
  while (!all.empty() && is_blank(all.front())) all.remove_prefix(1);
  while (!all.empty() && is_blank(all.back())) all.remove_suffix(1);
  return all;
}

double LineScanner::number() {
  const auto text = word();
  double value = 0;
  if (is_number(text, value)) return value;
  if (text.empty()) fail("a number is missing");
  fail(word_in_quotes(text) + " is no number" +
       (text.find(',') == text.npos ? "" : "; decimals need a point, not a comma"));
}

void LineScanner::fail(const std::string& what) const { throw InputError(where() + ": " + what); }

std::string LineScanner::where() const {
  return (file_.empty() ? "" : file_ + ", ") + "line " + std::to_string(line_);
}

}  // namespace raywave
