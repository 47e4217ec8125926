// SPDX-License-Identifier: Apache-2.0
/// Drivers that end the whole program, as those with LLVM do where it cannot compile a kernel.
#pragma once

#include <string>

namespace raywave::cl {

/// From now on, a driver that aborts leaves a line on standard error that says at which kernel, and
/// this exit code.
void explain_aborts(int exit_code);

/// What the driver is asked to do, "kernels/samples/samples.cl: find_samples on NAME", until it is
/// waited for; and what it may lack, empty: nothing known.
void driver_works_on(const std::string& what, const std::string& lacks);
void driver_is_done();

}  // namespace raywave::cl
