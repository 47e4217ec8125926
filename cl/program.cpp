// SPDX-License-Identifier: Apache-2.0
#include "cl/program.hpp"

#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "cl/compile_ahead.hpp"
#include "cl/device.hpp"
#include "cl/program_folder.hpp"
#include "host/common/cache.hpp"
#include "host/common/environment.hpp"
#include "host/common/stage_clock.hpp"

namespace raywave::cl {
namespace {

/// The text of a kernel file with every #include "name" replaced by that file, each once. Devices
/// compile one string, without include folders.
std::string with_includes(const std::string& file, std::set<std::string>& seen) {
  seen.insert(file);
  const auto it = kernel_files().find(file);
  if (it == kernel_files().end())
    throw DeviceError("kernel file " + file + " is not part of this program");
  std::istringstream in(it->second);
  std::string text = "#line 1 \"" + file + "\"\n";
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.starts_with("#include \"")) {
      const auto name = line.substr(10, line.find('"', 10) - 10);
      if (!seen.contains(name)) text += with_includes(name, seen);
      text += "#line " + std::to_string(number + 1) + " \"" + file + "\"\n";
    } else {
      text += line + "\n";
    }
  }
  return text;
}

std::string build_options(const Options& options, DeviceKind kind) {
  // Without -w, PoCL counts warnings on the screen: of wide vectors on processors without AVX-512
  std::string text = "-cl-std=CL1.2 -cl-kernel-arg-info -w";
  if (kind == DeviceKind::accelerator) text += " -DRAYWAVE_FPGA";
  for (const auto& [option, value] : options)
    text += " -D" + std::string(option.name) + "=" + value;
  return text;
}

/// Each option must have its default in the source: "#ifndef NAME".
void refuse_unknown(const Options& options, const ProgramSource& program) {
  for (const auto& [option, value] : options) {
    const auto name = std::string(option.name);
    if (program.text.find("\n#ifndef " + name + "\n") == std::string::npos)
      throw DeviceError("kernel file " + program.file + " has no option " + name);
  }
}

/// The program that kernels are of, from one of a binary. That one is built then.
::cl::Program loaded(const Device& device, const std::vector<unsigned char>& binary,
                     const std::string& flags) {
  const std::vector<::cl::Device> devices{device.handle()};
  const ::cl::Program program(device.context(), devices, ::cl::Program::Binaries{binary});
  if (needs_single_items(device.info())) return ::cl::linkProgram({program});
  program.build(devices, flags.c_str());
  return program;
}

/// The program that kernels are of, from one of a source, whose binary is the one to keep then.
::cl::Program built(const Device& device, const ::cl::Program& program, const std::string& flags) {
  if (needs_single_items(device.info())) {
    program.compile(flags.c_str());
    return ::cl::linkProgram({program});
  }
  program.build({device.handle()}, flags.c_str());
  return program;
}

/// Whether the driver keeps each kernel that it has compiled, at its first launch.
bool driver_keeps_kernels(const DeviceInfo& device) {
  return is_pocl(device) && !needs_single_items(device) &&
         environment_variable("POCL_KERNEL_CACHE") != "0";
}

}  // namespace

std::string one_source(const std::vector<ProgramSource>& programs) {
  std::map<std::string, std::string> macros;
  std::set<std::string> seen;
  std::string text;
  for (const auto& program : programs) {
    std::istringstream flags(program.flags);
    for (std::string flag; flags >> flag;) {
      if (!flag.starts_with("-D")) continue;
      const auto equals = flag.find('=');
      const auto macro = flag.substr(2, equals - 2);
      const auto value = equals == std::string::npos ? "" : flag.substr(equals + 1);
      if (const auto it = macros.emplace(macro, value).first; it->second != value)
        throw InputError("one source does not hold programs with " + macro + "=" + it->second +
                         " and " + macro + "=" + value +
                         ": give scenes of as many frames, like depths and one encoding");
    }
    if (!seen.contains(program.file)) text += with_includes(program.file, seen);
  }
  std::string defines;
  for (const auto& [macro, value] : macros) defines += "#define " + macro + " " + value + "\n";
  return defines + text;
}

Options with(Options options, const Options& more) {
  for (const auto& [option, value] : more) options[option] = value;
  return options;
}

Program::Program(const Device& device, const std::string& file, const Options& options)
    : device_(std::make_shared<Device>(device)), file_(file), options_(options) {
  if (is_rehearsal) return;
  const CompileClock clock;
  std::set<std::string> seen;
  const ProgramSource program{file, with_includes(file, seen),
                              build_options(options, device.info().kind)};
  refuse_unknown(options, program);
  const auto& source = program.text;
  const auto& flags = program.flags;
  const auto& info = device.info();

  if (const auto folder = program_folder(); folder && !info.compiles_always) {
    const auto binary = load_program(*folder, program, info);
    try {
      program_ = loaded(device, binary, flags);
    } catch (const ::cl::Error& error) {
      throw DeviceError((*folder / (program.name() + ".bin")).string() + " does not load on " +
                        info.name + ", driver " + info.driver + ": it was built for another; " +
                        error_text(error.err()));
    }
    return;
  }

  // PoCL, too, works on a source for tens of milliseconds before it finds it in its cache.
  auto& known = *device.programs_;
  const std::lock_guard lock(known.mutex);
  auto& of_device = known.built[source + '\n' + flags + '\n' + info.driver];
  if (of_device() && !is_recording()) {
    program_ = of_device;
    return;
  }

  const auto cached = "kernel-" +
                      hash_name(source + '\n' + flags + '\n' + info.platform + '\n' + info.name +
                                '\n' + info.version + '\n' + info.driver) +
                      ".bin";
  const auto known_binary = load_cached(cached);
  if (known_binary && !known_binary->empty()) {
    try {
      of_device = program_ = loaded(device, *known_binary, flags);
      if (!info.compiles_always) record_program(program, [&] { return *known_binary; });
      return;
    } catch (const ::cl::Error&) {
      // The binary is damaged, or the driver has changed since: compile again.
    }
  }
  if (!known_binary) CompileAhead::begin();
  driver_works_on(file + " on " + info.name, missing_tool(info));
  ::cl::Program compiled;
  try {
    compiled = ::cl::Program(device.context(), source);
    of_device = program_ = built(device, compiled, flags);
  } catch (const ::cl::Error& error) {
    std::string log;
    if (compiled()) {
      for (const auto& entry : compiled.getBuildInfo<CL_PROGRAM_BUILD_LOG>()) log += entry.second;
    }
    throw DeviceError(file + " does not compile on " + info.name + ", driver " + info.driver +
                      ", options " + flags + ": " + error_text(error.err()) + missing_tool(info) +
                      "\n" + log);
  }
  const auto binary = [compiled, info]() -> std::vector<unsigned char> {
    const auto all = checked(info, [&] { return compiled.getInfo<CL_PROGRAM_BINARIES>(); });
    return all.empty() ? std::vector<unsigned char>{} : all[0];
  };
  if (!info.compiles_always) record_program(program, binary);
  const auto keep = [cached, binary] {
    if (const auto made = binary(); !made.empty()) store_cached(cached, made.data(), made.size());
  };
  // A binary makes PoCL compile all kernels that were not launched yet; others than 3.1 compile all
  // of them once more, and are found in its own cache
  if (!driver_keeps_kernels(info))
    keep();
  else if (compiles_once(info))
    known.to_keep.push_back(keep);
  else
    store_cached(cached, nullptr, 0);
}

namespace {

/// A kernel that a rehearsal has asked for.
struct Rehearsed {
  Device device;
  std::string file;
  Options options;
  std::string kernel;
  Range local;  // groups of one item where none was launched
};

std::vector<Rehearsed>& rehearsed() {
  static std::vector<Rehearsed> all;
  return all;
}

}  // namespace

void compile_rehearsed() {
  const auto all = std::exchange(rehearsed(), {});
  for (auto it = all.rbegin(); it != all.rend(); ++it) {
    auto kernel = Program(it->device, it->file, it->options).kernel(it->kernel);
    if (driver_keeps_kernels(it->device.info())) kernel.compile(it->local);
  }
}

Kernel Program::kernel(const std::string& name) const {
  if (is_rehearsal) {
    rehearsed().push_back({*device_, file_, options_, name, {}});
    return Kernel(*device_, {}, name, launched_);
  }
  return Kernel(*device_,
                checked(device_->info(), [&] { return ::cl::Kernel(program_, name.c_str()); }),
                file_ + ": " + name, launched_);
}

Kernel::Kernel(Device device, ::cl::Kernel kernel, std::string name,
               std::shared_ptr<std::set<std::string>> launched)
    : device_(std::move(device)),
      kernel_(std::move(kernel)),
      name_(std::move(name)),
      launched_(std::move(launched)) {
  if (is_rehearsal) {
    rehearsed_ = rehearsed().size() - 1;
    return;
  }
  const auto items = checked(device_.info(), [&] {
    return kernel_.getWorkGroupInfo<CL_KERNEL_COMPILE_WORK_GROUP_SIZE>(device_.handle());
  });
  is_single_item_ = items[0] * items[1] * items[2] == 1;
  argument_types_.resize(
      checked(device_.info(), [&] { return kernel_.getInfo<CL_KERNEL_NUM_ARGS>(); }));
  for (cl_uint i = 0; i < argument_types_.size(); ++i) {
    try {
      auto& type = argument_types_[i];
      type = kernel_.getArgInfo<CL_KERNEL_ARG_TYPE_NAME>(i);
      while (!type.empty() && type.back() == '\0') type.pop_back();
      if (type.starts_with("struct ")) type.erase(0, 7);
    } catch (const ::cl::Error&) {
      // Programs from binaries may not give the types.
    }
  }
}

void Kernel::rehearse(Range local) const { rehearsed().at(rehearsed_).local = local; }

void Kernel::compile(Range local) {
  constexpr std::size_t most_bytes = 4096;  // of an argument that is no buffer
  const std::vector<float> zeros(1 << 18);
  const Buffer<float> buffer(device_, zeros, "arguments");
  for (cl_uint i = 0; i < argument_types_.size(); ++i) {
    if (kernel_.getArgInfo<CL_KERNEL_ARG_ADDRESS_QUALIFIER>(i) == CL_KERNEL_ARG_ADDRESS_GLOBAL) {
      kernel_.setArg(i, buffer.handle());
      continue;
    }
    // PoCL takes no other size than the argument's
    auto bytes = most_bytes;
    while (bytes > 0 && clSetKernelArg(kernel_(), i, bytes, zeros.data()) != CL_SUCCESS) --bytes;
  }
  enqueue(local, local);
  device_.finish();
}

void Kernel::check_count(std::size_t given) const {
  if (given != argument_types_.size())
    throw DeviceError(name_ + " takes " + std::to_string(argument_types_.size()) + " arguments, " +
                      std::to_string(given) + " given");
}

void Kernel::check_type(cl_uint i, const std::string& given) const {
  const auto& wanted = argument_types_[i];
  if (!wanted.empty() && wanted != given)
    throw DeviceError(name_ + ": argument " + std::to_string(i) + " is " + wanted + ", " + given +
                      " given");
}

/// Launches the kernel and waits for it. Some drivers compile now, between the moment when the
/// kernel is submitted and that when it starts.
void Kernel::launch_first(const ::cl::NDRange& global, const ::cl::NDRange& local) {
  device_.finish();
  driver_works_on(name_ + " on " + device_.info().name, missing_tool(device_.info()));
  const bool is_timed = device_.timing_queue()() != nullptr;
  const auto& queue = is_timed ? device_.timing_queue() : device_.queue();
  const auto before = Seconds::now();
  ::cl::Event event;
  queue.enqueueNDRangeKernel(kernel_, ::cl::NullRange, global, local, nullptr, &event);
  event.wait();
  const auto taken = Seconds::now() - before;
  if (!is_timed) return;
  cl_ulong submitted = 0, started = 0, ended = 0;
  try {
    submitted = event.getProfilingInfo<CL_PROFILING_COMMAND_SUBMIT>();
    started = event.getProfilingInfo<CL_PROFILING_COMMAND_START>();
    ended = event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
  } catch (const ::cl::Error&) {
    return;  // the launch has worked; its time stays with its stage
  }
  if (!(submitted <= started && started <= ended && submitted < ended)) return;
  const double share =
      static_cast<double>(started - submitted) / static_cast<double>(ended - submitted);
  compiling += {share * taken.wall, share * taken.processor};
}

void Kernel::enqueue(Range global, Range local) {
  if (is_single_item_) global = local = {};
  if (needs_single_items(device_.info())) local = {1, global.y ? 1u : 0u, global.z ? 1u : 0u};
  const auto round_up = [](std::size_t n, std::size_t step) {
    return (n + step - 1) / step * step;
  };
  const auto range = [](Range r) {
    return r.z ? ::cl::NDRange(r.x, r.y, r.z) : r.y ? ::cl::NDRange(r.x, r.y) : ::cl::NDRange(r.x);
  };
  const Range whole{round_up(global.x, local.x), global.y ? round_up(global.y, local.y) : 0,
                    global.z ? round_up(global.z, local.z) : 0};
  try {
    if (launched_->insert(name_).second)
      launch_first(range(whole), range(local));
    else
      device_.queue().enqueueNDRangeKernel(kernel_, ::cl::NullRange, range(whole), range(local));
  } catch (const ::cl::Error& error) {
    throw DeviceError(name_ + ": launch failed on " + device_.info().name + ": " +
                      error_text(error.err()) + missing_tool(device_.info()));
  }
}

}  // namespace raywave::cl
