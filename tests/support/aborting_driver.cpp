// SPDX-License-Identifier: Apache-2.0
// Loaded before OpenCL's loader (LD_PRELOAD): a driver that ends the program at the first kernel,
// as PoCL 6.0 does where LLVM 18 cannot compile one.
#include <cstdio>
#include <cstdlib>

extern "C" int clEnqueueNDRangeKernel(...) {
  std::fputs("LLVM ERROR: of a driver that aborts\n", stderr);
  std::abort();
}
