// SPDX-License-Identifier: Apache-2.0
/// Text files as words and numbers, whatever the program's locale is.
#pragma once

#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

namespace raywave {

/// A file in memory, as the system maps it.
class MappedFile {
public:
  /// throws  InputError when there is no such file
  explicit MappedFile(const std::filesystem::path& file);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  std::string_view bytes() const { return bytes_; }

private:
  std::string_view bytes_;
};

/// True where all of the word is a number, also with Fortran's exponent: 1d0. It may be infinite.
bool is_number(std::string_view word, double& value);

/// A number as its bytes lie in a file.
template <class T>
T number_at(const char* place) {
  T value;
  std::memcpy(&value, place, sizeof value);
  return value;
}

/// The start of a word, for messages, in quotes.
std::string word_in_quotes(std::string_view word);

/// The number with up to 6 digits.
std::string digits_of(double value);

/// The word in lower case (ASCII).
std::string lower(std::string_view word);

/// The words of a text, line by line. A line ends with \n, \r\n or \r.
class LineScanner {
public:
  /// file   starts the name of a line; empty: the mesh file itself
  /// joins  lines go on behind a \ at their end
  /// throws InputError for UTF-16; a byte order mark of UTF-8 is left out
  LineScanner(std::string_view text, std::string file, bool joins = false);

  /// Goes to the next line. False: there is none.
  bool next_line();
  /// Goes to the next word of the line; it stops before #. Empty: there is none.
  std::string_view word();
  /// The next word, where it stays.
  std::string_view peek() const {
    auto ahead = *this;
    return ahead.word();
  }
  /// The rest of the line, # and all, without blanks around it.
  std::string_view rest();
  /// The next word as a number.
  /// throws  InputError where it is none, naming the line
  double number();
  /// "line 7" or "red.mtl, line 7"
  std::string where() const;
  /// Throws an InputError about the line.
  [[noreturn]] void fail(const std::string& what) const;
  std::size_t line() const { return line_; }
  /// Where the current line starts, and the next.
  std::size_t begin() const { return begin_; }
  std::size_t end() const { return next_; }

private:
  void find_end();

  std::string_view text_;
  std::string file_;
  bool joins_;
  std::size_t line_ = 0, begin_ = 0, at_ = 0, end_ = 0, next_ = 0, more_ = 0;
};

}  // namespace raywave
