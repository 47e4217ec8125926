// SPDX-License-Identifier: Apache-2.0
/// What every reader program does (host/scene/reader_process.hpp starts them).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host/scene/reader_reply.hpp"

namespace raywave {

/// The whole of a reader program's main(): limits itself to the seconds and bytes that its first
/// two arguments give, discards its output, calls `work` with the other arguments, and then `send`
/// on the pipe that was its stdout; or sends what() of the exception that `work` threw.
///
/// Ends the process without destructors: third-party libraries may crash in theirs.
[[noreturn]] void serve(int argc, char** argv,
                        const std::function<void(const std::vector<std::string>& arguments)>& work,
                        const std::function<void(ReaderPipe&)>& send);

}  // namespace raywave
