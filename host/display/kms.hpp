// SPDX-License-Identifier: Apache-2.0
/// The display by kernel mode setting, and what it calls: tests put a kernel of their own there.
#pragma once

#include <xf86drm.h>
#include <xf86drmMode.h>

#include <functional>
#include <string>
#include <type_traits>
#include <vector>

#include "host/display/display.hpp"

// Of libdrm
#define RAYWAVE_DRM_FUNCTIONS(use)                                                                 \
  use(drmSetMaster) use(drmIsMaster) use(drmDropMaster) use(drmHandleEvent)                        \
      use(drmModeGetResources) use(drmModeFreeResources) use(drmModeGetConnector)                  \
          use(drmModeFreeConnector) use(drmModeGetConnectorTypeName) use(drmModeGetEncoder)        \
              use(drmModeFreeEncoder) use(drmModeGetCrtc) use(drmModeFreeCrtc) use(drmModeSetCrtc) \
                  use(drmModeAddFB) use(drmModeRmFB) use(drmModePageFlip)                          \
                      use(drmModeObjectGetProperties) use(drmModeFreeObjectProperties)             \
                          use(drmModeGetProperty) use(drmModeFreeProperty)                         \
                              use(drmModeObjectSetProperty) use(drmModeGetPropertyBlob)            \
                                  use(drmModeFreePropertyBlob) use(drmModeCreatePropertyBlob)      \
                                                                                                   \
                                      use(drmModeCreateDumbBuffer) use(drmModeMapDumbBuffer)       \
                                          use(drmModeDestroyDumbBuffer)

namespace raywave {

struct Libdrm {
#define RAYWAVE_MEMBER(name) std::function<std::remove_pointer_t<decltype(&::name)>> name;
  RAYWAVE_DRM_FUNCTIONS(RAYWAVE_MEMBER)
#undef RAYWAVE_MEMBER
  // Of the system
  std::function<std::vector<std::string>()> cards;  // "/dev/dri/card0" ...
  std::function<int(const std::string&)> open;      // -1: cannot be
  std::function<void(int)> close;
  std::function<void*(int, std::uint64_t, std::uint64_t)> map;  // descriptor, bytes, offset
  std::function<void(void*, std::uint64_t)> unmap;
  std::function<bool(int, double)> wait;  // for something to read: false after so many seconds
  std::function<double()> now;            // seconds of the monotonic clock
  std::function<void(double)> sleep_until;
};

std::unique_ptr<Display> kms_display(Libdrm drm);

}  // namespace raywave
