// SPDX-License-Identifier: Apache-2.0
/// A kernel with a graphics card of its own, which a test scripts: its clock goes on when somebody
/// waits.
#pragma once

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "host/display/kms.hpp"
#include "tests/support/catch.hpp"

namespace raywave::test {

inline drmModeModeInfo mode(int width, int height, double rate_hz, std::uint32_t type = 0) {
  drmModeModeInfo mode{};
  mode.hdisplay = static_cast<std::uint16_t>(width);
  mode.vdisplay = static_cast<std::uint16_t>(height);
  mode.htotal = 5000;
  mode.vtotal = 2000;
  mode.clock = static_cast<std::uint32_t>(std::lround(rate_hz * 1e4));
  mode.type = type;
  return mode;
}

/// What becomes of a flip.
struct Fate {
  int late = 0;          // refreshes
  bool is_lost = false;  // its event
  bool comes_twice = false;
  int error = 0;  // of the call
  bool unplugs = false;
};

class FakeKernel {
public:
  struct Screen {  // a connector with its CRTC
    std::vector<drmModeModeInfo> modes;
    std::string edid;
    bool is_plugged = true, is_on = false;
    std::uint32_t framebuffer = 0;
    drmModeModeInfo mode{};
    std::vector<std::uint8_t> shown;  // the buffer's bytes as the last flip left them
  };

  std::vector<Screen> screens{2};
  std::deque<Fate> fates;
  bool is_held_by_other = false, refuses_mode = false, keeps_lut = false, counts = true,
       may_be_opened = true;
  std::uint32_t first_sequence = 1000;
  double now_s = 50, rate_hz = 60;
  std::map<std::uint32_t, std::uint64_t> properties{{21, 7}, {22, 8}, {23, 0}};
  std::map<std::uint64_t, std::string> blobs{{7, "an old gamma table"}, {8, "an old CTM"}};
  bool has_lut = true;
  std::uint32_t pitch_extra = 64;
  std::map<std::uint32_t, std::vector<std::uint8_t>> buffers;  // by handle and framebuffer

  FakeKernel() {
    screens[0].modes = {mode(1920, 1200, 60, DRM_MODE_TYPE_PREFERRED)};
    screens[0].is_on = true;
    screens[0].framebuffer = 900;
    screens[1].modes = {mode(64, 48, 60, DRM_MODE_TYPE_PREFERRED), mode(64, 48, 75),
                        mode(32, 16, 60)};
    screens[1].is_on = true;
    screens[1].framebuffer = 901;
    screens[1].mode = mode(32, 16, 60);
  }

  std::unique_ptr<Display> display() { return kms_display(functions()); }
  double sequence_now() const { return std::floor(now_s * rate_hz); }
  /// Channel c (0 blue, 1 green, 2 red) of a pixel that is shown on the second screen.
  std::uint8_t shown(int x, int y, int c) const {
    const auto pitch = static_cast<std::size_t>(4 * screens[1].mode.hdisplay) + pitch_extra;
    return screens[1].shown.at(static_cast<std::size_t>(y) * pitch +
                               static_cast<std::size_t>(4 * x + c));
  }
  /// As it was before anybody came.
  bool is_as_before() const {
    return screens[1].framebuffer == 901 && screens[1].mode.hdisplay == 32 && buffers.empty() &&
           blob(21) == "an old gamma table" && blob(22) == "an old CTM" && properties.at(23) == 0 &&
           open_files == 0;
  }

  int open_files = 0;

private:
  struct Event {
    double time_s;
    void* data;
  };

  std::string blob(std::uint32_t property) const {
    const auto found = blobs.find(properties.at(property));
    return found == blobs.end() ? "" : found->second;
  }
  template <class T>
  T* made(T value) {
    auto kept = std::make_shared<T>(value);
    things_.push_back(kept);
    return kept.get();
  }
  /// Connectors are 1 and 2, their encoders 11 and 12, CRTCs 31 and 32.
  Screen& screen(std::uint32_t id) { return screens.at((id - 1) % 10); }

  void give_objects(Libdrm& drm);
  void give_properties(Libdrm& drm);
  void give_buffers(Libdrm& drm);
  void give_flips(Libdrm& drm);
  Libdrm functions() {
    Libdrm drm;
    drm.cards = [] { return std::vector<std::string>{"/dev/dri/card0"}; };
    drm.open = [this](const std::string&) { return may_be_opened ? ++open_files, 5 : -1; };
    drm.close = [this](int) { --open_files; };
    drm.now = [this] { return now_s; };
    drm.sleep_until = [this](double time_s) { now_s = std::max(now_s, time_s); };
    drm.drmSetMaster = [this](int) { return is_held_by_other ? -1 : 0; };
    drm.drmIsMaster = [this](int) { return is_held_by_other ? 0 : 1; };
    drm.drmDropMaster = [](int) { return 0; };
    give_objects(drm);
    give_properties(drm);
    give_buffers(drm);
    give_flips(drm);
    return drm;
  }

  std::vector<std::shared_ptr<void>> things_;
  std::deque<Event> events_;
  std::uint32_t next_handle_ = 100;
  std::uint32_t ids_[2] = {1, 2}, crtcs_[2] = {31, 32}, edid_[1] = {20}, crtc_props_[2] = {21, 22},
                connector_props_[1] = {23};
  std::uint64_t values_[2] = {};
};

inline void FakeKernel::give_objects(Libdrm& drm) {
  drm.drmModeGetResources = [this](int) {
    drmModeRes all{};
    all.count_connectors = all.count_crtcs = 2;
    all.connectors = ids_;
    all.crtcs = crtcs_;
    return made(all);
  };
  drm.drmModeFreeResources = [](drmModeRes*) {};
  drm.drmModeGetConnector = [this](int, std::uint32_t id) -> drmModeConnector* {
    if (id < 1 || id > 2) return nullptr;
    auto& of = screen(id);
    drmModeConnector one{};
    one.connector_id = id;
    one.connector_type = DRM_MODE_CONNECTOR_HDMIA;
    one.connector_type_id = id;
    one.encoder_id = 10 + id;
    one.connection = of.is_plugged ? DRM_MODE_CONNECTED : DRM_MODE_DISCONNECTED;
    one.count_modes = static_cast<int>(of.modes.size());
    one.modes = of.modes.data();
    if (of.edid.empty()) return made(one);
    one.count_props = 1;
    one.props = edid_;
    one.prop_values = made(std::uint64_t{40 + id});
    return made(one);
  };
  drm.drmModeFreeConnector = [](drmModeConnector*) {};
  drm.drmModeGetConnectorTypeName = [](std::uint32_t) { return "HDMI-A"; };
  drm.drmModeGetEncoder = [this](int, std::uint32_t id) {
    drmModeEncoder one{};
    one.crtc_id = 20 + id;
    return made(one);
  };
  drm.drmModeFreeEncoder = [](drmModeEncoder*) {};
  drm.drmModeGetCrtc = [this](int, std::uint32_t id) {
    const auto& of = screen(id);
    drmModeCrtc one{};
    one.crtc_id = id;
    one.buffer_id = of.framebuffer;
    one.mode_valid = of.is_on;
    one.mode = of.mode;
    return made(one);
  };
  drm.drmModeFreeCrtc = [](drmModeCrtc*) {};
  drm.drmModeSetCrtc = [this](int, std::uint32_t id, std::uint32_t framebuffer, std::uint32_t,
                              std::uint32_t, std::uint32_t*, int count, drmModeModeInfo* to) {
    if (refuses_mode && framebuffer < 900) return -EINVAL;
    auto& of = screen(id);
    of.framebuffer = framebuffer;
    of.is_on = count > 0;
    if (to) of.mode = *to;
    return 0;
  };
}

inline void FakeKernel::give_properties(Libdrm& drm) {
  drm.drmModeObjectGetProperties = [this](int, std::uint32_t, std::uint32_t type) {
    drmModeObjectProperties all{};
    const bool of_crtc = type == DRM_MODE_OBJECT_CRTC;
    all.count_props = of_crtc ? (has_lut ? 2 : 0) : 1;
    all.props = of_crtc ? crtc_props_ : connector_props_;
    for (std::uint32_t i = 0; i < all.count_props; ++i) values_[i] = properties[all.props[i]];
    all.prop_values = values_;
    return made(all);
  };
  drm.drmModeFreeObjectProperties = [](drmModeObjectProperties*) {};
  drm.drmModeGetProperty = [this](int, std::uint32_t id) {
    drmModePropertyRes one{};
    one.prop_id = id;
    std::strcpy(one.name, id == 20   ? "EDID"
                          : id == 21 ? "GAMMA_LUT"
                          : id == 22 ? "CTM"
                                     : "Broadcast RGB");
    if (id != 23) return made(one);
    auto* const names = made(
        std::pair<drm_mode_property_enum, drm_mode_property_enum>{{0, "Automatic"}, {1, "Full"}});
    one.count_enums = 2;
    one.enums = &names->first;
    return made(one);
  };
  drm.drmModeFreeProperty = [](drmModePropertyRes*) {};
  drm.drmModeObjectSetProperty = [this](int, std::uint32_t, std::uint32_t, std::uint32_t id,
                                        std::uint64_t value) {
    if (keeps_lut && id == 21) return -EINVAL;
    if (properties[id] != value) blobs.erase(properties[id]);  // nobody holds it any more
    properties[id] = value;
    return 0;
  };
  drm.drmModeGetPropertyBlob = [this](int, std::uint32_t id) -> drmModePropertyBlobRes* {
    auto* const bytes = id == 41 || id == 42 ? &screen(id).edid
                        : blobs.contains(id) ? &blobs[id]
                                             : nullptr;
    if (!bytes) return nullptr;
    return made(
        drmModePropertyBlobRes{id, static_cast<std::uint32_t>(bytes->size()), bytes->data()});
  };
  drm.drmModeFreePropertyBlob = [](drmModePropertyBlobRes*) {};
  drm.drmModeCreatePropertyBlob = [this](int, const void* data, std::size_t size,
                                         std::uint32_t* id) {
    *id = ++next_handle_;
    blobs[*id] = std::string(static_cast<const char*>(data), size);
    return 0;
  };
}

inline void FakeKernel::give_buffers(Libdrm& drm) {
  drm.drmModeCreateDumbBuffer = [this](int, std::uint32_t width, std::uint32_t height,
                                       std::uint32_t, std::uint32_t, std::uint32_t* handle,
                                       std::uint32_t* pitch, std::uint64_t* bytes) {
    *handle = ++next_handle_;
    *pitch = 4 * width + pitch_extra;
    *bytes = std::uint64_t{*pitch} * height;
    buffers[*handle].assign(*bytes, 0xcc);
    return 0;
  };
  drm.drmModeAddFB = [](int, std::uint32_t, std::uint32_t, std::uint8_t, std::uint8_t,
                        std::uint32_t, std::uint32_t handle, std::uint32_t* framebuffer) {
    *framebuffer = handle;
    return 0;
  };
  drm.drmModeRmFB = [](int, std::uint32_t) { return 0; };
  drm.drmModeMapDumbBuffer = [](int, std::uint32_t handle, std::uint64_t* offset) {
    *offset = handle;
    return 0;
  };
  drm.drmModeDestroyDumbBuffer = [this](int, std::uint32_t handle) {
    buffers.erase(handle);
    return 0;
  };
  drm.map = [this](int, std::uint64_t, std::uint64_t offset) -> void* {
    return buffers.at(static_cast<std::uint32_t>(offset)).data();
  };
  drm.unmap = [](void*, std::uint64_t) {};
}

inline void FakeKernel::give_flips(Libdrm& drm) {
  drm.drmModePageFlip = [this](int, std::uint32_t crtc, std::uint32_t framebuffer, std::uint32_t,
                               void* data) {
    Fate fate;
    if (!fates.empty()) {
      fate = fates.front();
      fates.pop_front();
    }
    if (fate.unplugs) screen(crtc).is_plugged = false;
    if (fate.error != 0) return -fate.error;
    screen(crtc).framebuffer = framebuffer;
    const double at_s = (sequence_now() + 1 + fate.late) / rate_hz + 1e-9;
    if (!fate.is_lost) events_.push_back({at_s, data});
    if (fate.comes_twice) events_.push_back({at_s + 0.9 / rate_hz, data});  // later
    return 0;
  };
  drm.wait = [this](int, double seconds) {
    if (events_.empty()) {
      now_s += seconds;
      return false;
    }
    now_s = std::max(now_s, events_.front().time_s);
    return true;
  };
  drm.drmHandleEvent = [this](int fd, drmEventContext* context) {
    while (!events_.empty() && events_.front().time_s <= now_s) {
      const auto event = events_.front();
      events_.pop_front();
      screens[1].shown = buffers.at(screens[1].framebuffer);
      const auto whole_s = std::floor(event.time_s);
      const auto sequence =
          static_cast<std::uint32_t>(std::floor(event.time_s * rate_hz) - 3000) + first_sequence;
      context->page_flip_handler2(fd, counts ? sequence : 0, static_cast<unsigned>(whole_s),
                                  static_cast<unsigned>(1e6 * (event.time_s - whole_s)), 32,
                                  event.data);
    }
    return 0;
  };
}

}  // namespace raywave::test
