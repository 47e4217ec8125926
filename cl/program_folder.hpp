// SPDX-License-Identifier: Apache-2.0
/// Programs built in advance, for devices without an online compiler (docs/devices.md).
///
/// A folder of them holds, for each kernel file and set of options that a run needs, NAME.bin, what
/// the device loads, and lists all in manifest.tsv: NAME, digest of NAME.bin, kernel file, options.
/// NAME is the kernel file's stem and a hash of source and options.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cl/device.hpp"

namespace raywave::cl {

/// A program before it is built.
struct ProgramSource {
  std::string file;   // kernel file, below kernels/
  std::string text;   // with its includes
  std::string flags;  // flags of the compiler

  std::string name() const;
};

/// All kernels of some programs in one text, which needs no options: an FPGA's one bitstream
/// (cl/program.cpp).
///
/// throws  InputError when they need different values of an option
std::string one_source(const std::vector<ProgramSource>& programs);

/// Contents of NAME.bin in `folder`.
///
/// throws  DeviceError naming the file, and the command that makes it, when it is not there or is
///         not what the manifest says
std::vector<unsigned char> load_program(const std::filesystem::path& folder,
                                        const ProgramSource& source, const DeviceInfo& device);

/// While it lives, every program that this process builds is noted.
class ProgramRecorder {
public:
  /// folder  is made when missing, and gets them, too; none: another compiler makes the binaries
  /// throws  InputError when the folder cannot be written, DeviceError when another recorder lives
  explicit ProgramRecorder(std::optional<std::filesystem::path> folder = {});
  ~ProgramRecorder();
  ProgramRecorder(const ProgramRecorder&) = delete;
  ProgramRecorder& operator=(const ProgramRecorder&) = delete;

  /// The programs, in the order of being built.
  const std::vector<ProgramSource>& programs() const { return programs_; }

private:
  friend void record_program(const ProgramSource& source,
                             const std::function<std::vector<unsigned char>()>& binary);
  std::optional<std::filesystem::path> folder_;
  std::vector<ProgramSource> programs_;
};

/// Whether a recorder lives.
bool is_recording();

/// Tells the recorder, if there is one; `binary` is called where it writes. For cl/program.cpp.
void record_program(const ProgramSource& source,
                    const std::function<std::vector<unsigned char>()>& binary);

}  // namespace raywave::cl
