// SPDX-License-Identifier: Apache-2.0
#include "host/common/error.hpp"
#include "host/display/display.hpp"

#ifdef RAYWAVE_LIBDRM
#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <span>
#include <utility>

#include "host/common/text.hpp"
#include "host/display/kms.hpp"
#include "host/display/loaded.hpp"
#endif

namespace raywave {

#ifdef RAYWAVE_LIBDRM
namespace {

/// What libdrm allocates, freed at the end of the scope.
template <class T, class Free>
auto held(T* thing, const Free& free) {
  return std::unique_ptr<T, std::function<void(T*)>>(thing, free);
}

double rate_of(const drmModeModeInfo& mode) {
  const double pixels = double{1} * mode.htotal * mode.vtotal;
  return pixels > 0 ? 1e3 * mode.clock / pixels : 0;
}

/// A connector of a card.
struct Connector {
  std::string card;
  std::uint32_t id = 0;
  DisplayOutput output;
};

/// A value that an object of the kernel's has, and what it had before.
struct Setting {
  std::uint32_t object = 0, type = 0, property = 0;
  std::string name;
  std::uint64_t value = 0, before = 0;
  std::vector<std::uint8_t> blob_before;  // what `before` names, where it is a blob
};

/// Values that let levels through as they are: blobs without content are identities.
struct Identity {
  std::uint32_t type;
  const char *property, *value;  // nullptr: 0
};
constexpr std::array<Identity, 6> identities{
    {{DRM_MODE_OBJECT_CRTC, "DEGAMMA_LUT", nullptr},
     {DRM_MODE_OBJECT_CRTC, "CTM", nullptr},
     {DRM_MODE_OBJECT_CRTC, "GAMMA_LUT", nullptr},
     {DRM_MODE_OBJECT_CRTC, "VRR_ENABLED", nullptr},
     {DRM_MODE_OBJECT_CONNECTOR, "Broadcast RGB", "Full"},  // HDMI's limited range cuts levels
     {DRM_MODE_OBJECT_CONNECTOR, "scaling mode", "None"}}};

struct Buffer {
  std::uint32_t handle = 0, pitch = 0, framebuffer = 0;
  std::uint64_t bytes = 0;
  std::uint8_t* pixels = nullptr;
};

/// A flip that was asked for. The kernel's event names it, whenever it comes.
struct Pending {
  int events = 0;
  unsigned sequence = 0;
  double time_s = 0;
};

constexpr double patience_s = 1;

class KmsDisplay : public Display {
public:
  explicit KmsDisplay(Libdrm drm) : drm_(std::move(drm)) {}
  ~KmsDisplay() override { close(); }

  std::vector<DisplayOutput> list() override {
    std::vector<DisplayOutput> outputs;
    for (const auto& connector : connectors()) outputs.push_back(connector.output);
    return outputs;
  }

  DisplayOutput open(const WantedOutput& wanted) override;
  void flip(const LevelFrame& frame, std::uint64_t refresh) override;
  Flip event() override;
  void close() noexcept override;
  Json describe() const override;

private:
  std::vector<Connector> connectors();
  DisplayOutput output_of(const drmModeConnector& connector, int fd);
  std::optional<Edid> edid_of(const drmModeConnector& connector, int fd);
  drmModeModeInfo mode_of(const drmModeConnector& connector, const WantedOutput& wanted) const;
  std::uint32_t crtc_of(const drmModeConnector& connector, const drmModeRes& resources);
  void make_buffer(Buffer& buffer, glm::ivec2 size_px);
  void set_identities();
  std::uint64_t value_of(const Setting& setting);
  void restore() noexcept;
  [[noreturn]] void fail(const std::string& what);
  double period_s() const { return 1 / output_.rate_hz; }

  Libdrm drm_;
  int fd_ = -1;
  std::string card_;
  DisplayOutput output_;
  std::uint32_t connector_ = 0, crtc_ = 0;
  drmModeModeInfo mode_{};
  std::optional<drmModeCrtc> before_;
  std::vector<Setting> settings_;
  std::array<Buffer, 2> buffers_;
  // Events of earlier flips may still come
  std::array<Pending, 8> pending_;
  std::uint64_t asked_ = 0, arrived_ = 0, counted_by_time_ = 0, stray_ = 0;
  bool reads_back_ = false, is_restored_ = false, knows_gamma_ = false;
  std::uint64_t read_back_ = 0;
  double asked_s_ = 0;
  unsigned sequence_ = 0;
  Flip last_;
};

std::vector<Connector> KmsDisplay::connectors() {
  std::vector<Connector> all;
  std::string refused;
  for (const auto& card : drm_.cards()) {
    const int fd = drm_.open(card);
    if (fd < 0) {
      refused = card + ": cannot be opened: " + std::strerror(errno) +
                "; those of the group video may, mostly";
      continue;
    }
    if (const auto resources = held(drm_.drmModeGetResources(fd), drm_.drmModeFreeResources)) {
      for (const auto id : std::span(resources->connectors, resources->count_connectors)) {
        const auto connector = held(drm_.drmModeGetConnector(fd, id), drm_.drmModeFreeConnector);
        if (!connector || connector->connection == DRM_MODE_DISCONNECTED ||
            connector->count_modes == 0)
          continue;
        all.push_back({card, id, output_of(*connector, fd)});
      }
    }
    drm_.close(fd);
  }
  if (all.empty() && !refused.empty()) throw DeviceError(refused);
  for (auto& one : all)  // cards count each by themselves
    if (std::count_if(all.begin(), all.end(), [&](const Connector& other) {
          return other.output.name == one.output.name;
        }) > 1)
      one.output.name = std::filesystem::path(one.card).filename().string() + "-" + one.output.name;
  return all;
}

DisplayOutput KmsDisplay::output_of(const drmModeConnector& connector, int fd) {
  DisplayOutput output;
  const char* const type = drm_.drmModeGetConnectorTypeName(connector.connector_type);
  output.name =
      std::string(type ? type : "unknown") + "-" + std::to_string(connector.connector_type_id);
  output.edid = edid_of(connector, fd);
  const std::span modes(connector.modes, static_cast<std::size_t>(connector.count_modes));
  auto mode = std::find_if(modes.begin(), modes.end(), [](const drmModeModeInfo& one) {
    return (one.type & DRM_MODE_TYPE_PREFERRED) != 0;
  });
  if (mode == modes.end()) mode = modes.begin();
  output.size_px = {mode->hdisplay, mode->vdisplay};
  output.rate_hz = rate_of(*mode);
  return output;
}

std::optional<Edid> KmsDisplay::edid_of(const drmModeConnector& connector, int fd) {
  for (int i = 0; i < connector.count_props; ++i) {
    const auto property =
        held(drm_.drmModeGetProperty(fd, connector.props[i]), drm_.drmModeFreeProperty);
    if (!property || std::string_view(property->name) != "EDID") continue;
    const auto blob =
        held(drm_.drmModeGetPropertyBlob(fd, static_cast<std::uint32_t>(connector.prop_values[i])),
             drm_.drmModeFreePropertyBlob);
    if (blob) return read_edid({static_cast<const std::uint8_t*>(blob->data), blob->length});
  }
  return {};
}

drmModeModeInfo KmsDisplay::mode_of(const drmModeConnector& connector,
                                    const WantedOutput& wanted) const {
  const drmModeModeInfo* best = nullptr;
  std::string others;
  constexpr std::uint32_t odd = DRM_MODE_FLAG_INTERLACE | DRM_MODE_FLAG_DBLSCAN;
  const auto distance = [&](const drmModeModeInfo& mode) {
    if (wanted.rate_hz > 0) return std::abs(rate_of(mode) - wanted.rate_hz);
    return mode.type & DRM_MODE_TYPE_PREFERRED ? 0 : 1.0;
  };
  for (const auto& mode : std::span(connector.modes, connector.count_modes)) {
    const bool fits = mode.hdisplay == wanted.size_px.x && mode.vdisplay == wanted.size_px.y &&
                      !(mode.flags & odd) && rate_of(mode) > 0 &&
                      (wanted.rate_hz == 0 || is_rate(rate_of(mode), wanted.rate_hz));
    if (fits && (!best || distance(mode) < distance(*best))) best = &mode;
    const auto text = size_text({mode.hdisplay, mode.vdisplay}) +
                      format(mode.flags & odd ? " interlaced" : " at %.4g Hz", rate_of(mode));
    if (others.find(text) == others.npos) others += (others.empty() ? "" : ", ") + text;
  }
  if (best) return *best;
  throw InputError("output " + one_line(output_.name) + " has no mode of the frames, " +
                   size_text(wanted.size_px) +
                   (wanted.rate_hz > 0 ? format(" at %.4g Hz", wanted.rate_hz) : "") + "; it has " +
                   others);
}

/// The CRTC that drives the connector, else one that could and drives nothing.
std::uint32_t KmsDisplay::crtc_of(const drmModeConnector& connector, const drmModeRes& resources) {
  if (const auto now =
          held(drm_.drmModeGetEncoder(fd_, connector.encoder_id), drm_.drmModeFreeEncoder);
      now && now->crtc_id != 0)
    return now->crtc_id;
  for (const auto id : std::span(connector.encoders, connector.count_encoders)) {
    const auto encoder = held(drm_.drmModeGetEncoder(fd_, id), drm_.drmModeFreeEncoder);
    for (int i = 0; encoder && i < resources.count_crtcs; ++i) {
      if (!(encoder->possible_crtcs >> i & 1)) continue;
      const auto crtc = held(drm_.drmModeGetCrtc(fd_, resources.crtcs[i]), drm_.drmModeFreeCrtc);
      if (crtc && !crtc->mode_valid) return crtc->crtc_id;
    }
  }
  throw DeviceError("output " + one_line(output_.name) +
                    ": the graphics card drives as many outputs as it can; switch one off");
}

void KmsDisplay::make_buffer(Buffer& buffer, glm::ivec2 size_px) {
  std::uint64_t offset = 0;
  const auto width = static_cast<std::uint32_t>(size_px.x),
             height = static_cast<std::uint32_t>(size_px.y);
  if (drm_.drmModeCreateDumbBuffer(fd_, width, height, 32, 0, &buffer.handle, &buffer.pitch,
                                   &buffer.bytes) != 0 ||
      drm_.drmModeAddFB(fd_, width, height, 24, 32, buffer.pitch, buffer.handle,
                        &buffer.framebuffer) != 0 ||
      drm_.drmModeMapDumbBuffer(fd_, buffer.handle, &offset) != 0)
    fail(std::string("no buffer can be had: ") + std::strerror(errno));
  buffer.pixels = static_cast<std::uint8_t*>(drm_.map(fd_, buffer.bytes, offset));
  if (!buffer.pixels) fail(std::string("no buffer can be mapped: ") + std::strerror(errno));
  std::memset(buffer.pixels, 0, buffer.bytes);
}

std::uint64_t KmsDisplay::value_of(const Setting& setting) {
  const auto all = held(drm_.drmModeObjectGetProperties(fd_, setting.object, setting.type),
                        drm_.drmModeFreeObjectProperties);
  for (std::uint32_t i = 0; all && i < all->count_props; ++i)
    if (all->props[i] == setting.property) return all->prop_values[i];
  return ~std::uint64_t{0};
}

void KmsDisplay::set_identities() {
  for (const auto& identity : identities) {
    const auto object = identity.type == DRM_MODE_OBJECT_CRTC ? crtc_ : connector_;
    const auto all = held(drm_.drmModeObjectGetProperties(fd_, object, identity.type),
                          drm_.drmModeFreeObjectProperties);
    for (std::uint32_t i = 0; all && i < all->count_props; ++i) {
      const auto property =
          held(drm_.drmModeGetProperty(fd_, all->props[i]), drm_.drmModeFreeProperty);
      if (!property || std::string_view(property->name) != identity.property) continue;
      Setting setting{
          object, identity.type, property->prop_id, property->name, 0, all->prop_values[i], {}};
      if (identity.value) {
        const std::span names(property->enums, static_cast<std::size_t>(property->count_enums));
        const auto wanted = std::find_if(names.begin(), names.end(), [&](const auto& one) {
          return std::string_view(one.name) == identity.value;
        });
        if (wanted == names.end()) continue;
        setting.value = wanted->value;
      } else if (const auto blob = held(
                     drm_.drmModeGetPropertyBlob(fd_, static_cast<std::uint32_t>(setting.before)),
                     drm_.drmModeFreePropertyBlob);
                 setting.before != 0 && blob) {
        const auto* const bytes = static_cast<const std::uint8_t*>(blob->data);
        setting.blob_before.assign(bytes, bytes + blob->length);
      }
      if (setting.name == "GAMMA_LUT") knows_gamma_ = true;
      settings_.push_back(setting);
      if (setting.before != setting.value)
        drm_.drmModeObjectSetProperty(fd_, object, identity.type, setting.property, setting.value);
      if (value_of(setting) != setting.value)
        fail("its " + setting.name + " changes levels, and the driver does not let go of it");
    }
  }
}

DisplayOutput KmsDisplay::open(const WantedOutput& wanted) {
  const auto all = connectors();
  std::vector<DisplayOutput> outputs;
  for (const auto& one : all) outputs.push_back(one.output);
  const auto& chosen =
      all[static_cast<std::size_t>(&find_output(outputs, wanted.name) - outputs.data())];
  card_ = chosen.card;
  connector_ = chosen.id;
  output_ = chosen.output;
  reads_back_ = wanted.reads_back;
  fd_ = drm_.open(card_);
  if (fd_ < 0) throw DeviceError(card_ + ": cannot be opened: " + std::strerror(errno));
  if (drm_.drmSetMaster(fd_) != 0 && !drm_.drmIsMaster(fd_))
    fail(
        "another program holds the screens; give --backend window on a desktop, or run this on a "
        "text console (Ctrl-Alt-F3) after the desktop was stopped");
  const auto resources = held(drm_.drmModeGetResources(fd_), drm_.drmModeFreeResources);
  const auto connector = held(drm_.drmModeGetConnector(fd_, connector_), drm_.drmModeFreeConnector);
  if (!resources || !connector) fail("it is gone");
  mode_ = mode_of(*connector, wanted);
  crtc_ = crtc_of(*connector, *resources);
  output_.size_px = wanted.size_px;
  output_.rate_hz = rate_of(mode_);
  const auto crtc = held(drm_.drmModeGetCrtc(fd_, crtc_), drm_.drmModeFreeCrtc);
  if (!crtc) fail("it is gone");
  before_ = *crtc;
  for (auto& buffer : buffers_) make_buffer(buffer, wanted.size_px);
  if (const int error =
          drm_.drmModeSetCrtc(fd_, crtc_, buffers_[0].framebuffer, 0, 0, &connector_, 1, &mode_))
    fail("the mode " + size_text(wanted.size_px) + format(" at %.4g Hz", output_.rate_hz) +
         " is refused: " + std::strerror(-error));
  set_identities();
  const auto now = held(drm_.drmModeGetCrtc(fd_, crtc_), drm_.drmModeFreeCrtc);
  if (!now || now->buffer_id != buffers_[0].framebuffer || !now->mode_valid ||
      now->mode.hdisplay != mode_.hdisplay || now->mode.vdisplay != mode_.vdisplay ||
      now->mode.clock != mode_.clock)
    fail("the driver has set another mode than it was asked for");
  return output_;
}

void KmsDisplay::flip(const LevelFrame& frame, std::uint64_t refresh) {
  if (fd_ < 0) throw DeviceError("output " + one_line(output_.name) + ": was closed");
  auto& buffer = buffers_[(asked_ + 1) % 2];
  std::vector<std::uint32_t> row(static_cast<std::size_t>(frame.size_px.x));
  for (int y = 0; y < frame.size_px.y; ++y) {
    fill_row(frame, y, row.data());
    auto* const place = buffer.pixels + static_cast<std::size_t>(y) * buffer.pitch;
    std::memcpy(place, row.data(), 4 * row.size());
    if (reads_back_ && std::memcmp(place, row.data(), 4 * row.size()) != 0)
      fail("a buffer does not hold what was written into it");
  }
  if (reads_back_) ++read_back_;
  // The kernel flips at the next refresh
  if (arrived_ > 0 && refresh > last_.refresh + 1)
    drm_.sleep_until(last_.time_s +
                     (static_cast<double>(refresh - last_.refresh) - 0.75) * period_s());
  auto& pending = pending_[asked_ % pending_.size()];
  stray_ += static_cast<std::uint64_t>(std::max(pending.events - 1, 0));
  pending = {};
  asked_s_ = drm_.now();
  if (const int error =
          drm_.drmModePageFlip(fd_, crtc_, buffer.framebuffer, DRM_MODE_PAGE_FLIP_EVENT, &pending))
    fail(error == -EACCES ? "another program has taken the screens"
                          : std::string("a flip is refused: ") + std::strerror(-error));
  ++asked_;
}

Flip KmsDisplay::event() {
  auto& pending = pending_[(asked_ - 1) % pending_.size()];
  drmEventContext context{};
  context.version = 3;
  context.page_flip_handler2 = [](int, unsigned sequence, unsigned s, unsigned us, unsigned,
                                  void* data) {
    auto& flip = *static_cast<Pending*>(data);
    if (flip.events++ == 0) {
      flip.sequence = sequence;
      flip.time_s = s + 1e-6 * us;
    }
  };
  const double end_s = drm_.now() + patience_s;
  while (pending.events == 0) {
    const double left_s = end_s - drm_.now();
    if (left_s <= 0 || !drm_.wait(fd_, left_s))
      fail(format("no event of flip %.0f came within a second", static_cast<double>(asked_ - 1)));
    drm_.drmHandleEvent(fd_, &context);
  }
  Flip flip{0, pending.time_s, asked_s_};
  if (arrived_ > 0) {
    // Some drivers do not count. The kernel's number has 32 bits.
    unsigned refreshes = pending.sequence - sequence_;
    if (refreshes == 0 || refreshes > 0x7fffffff) {
      refreshes = static_cast<unsigned>(
          std::clamp(std::round((flip.time_s - last_.time_s) / period_s()), 1.0, 1e9));
      ++counted_by_time_;
    }
    flip.refresh = last_.refresh + refreshes;
  }
  sequence_ = pending.sequence;
  last_ = flip;
  ++arrived_;
  return flip;
}

/// Ends with why: what was pulled out cannot do anything.
void KmsDisplay::fail(const std::string& what) {
  const auto connector = held(drm_.drmModeGetConnector(fd_, connector_), drm_.drmModeFreeConnector);
  const bool is_there = connector && connector->connection != DRM_MODE_DISCONNECTED;
  const auto text = "output " + one_line(output_.name) + ": " + (is_there ? what : "was unplugged");
  close();
  throw DeviceError(text);
}

void KmsDisplay::restore() noexcept {
  is_restored_ = true;
  const auto note = [&](int error) { is_restored_ = is_restored_ && error == 0; };
  for (auto setting = settings_.rbegin(); setting != settings_.rend(); ++setting) {
    if (setting->before == setting->value) continue;
    auto value = setting->before;
    std::uint32_t blob = 0;
    if (!setting->blob_before.empty() &&
        drm_.drmModeCreatePropertyBlob(fd_, setting->blob_before.data(),
                                       setting->blob_before.size(), &blob) == 0)
      value = blob;
    note(drm_.drmModeObjectSetProperty(fd_, setting->object, setting->type, setting->property,
                                       value));
  }
  if (!before_) return;
  note(before_->mode_valid ? drm_.drmModeSetCrtc(fd_, crtc_, before_->buffer_id, before_->x,
                                                 before_->y, &connector_, 1, &before_->mode)
                           : drm_.drmModeSetCrtc(fd_, crtc_, 0, 0, 0, nullptr, 0, nullptr));
}

void KmsDisplay::close() noexcept {
  if (fd_ < 0) return;
  restore();
  for (auto& buffer : buffers_) {
    if (buffer.pixels) drm_.unmap(buffer.pixels, buffer.bytes);
    if (buffer.framebuffer) drm_.drmModeRmFB(fd_, buffer.framebuffer);
    if (buffer.handle) drm_.drmModeDestroyDumbBuffer(fd_, buffer.handle);
    buffer = {};
  }
  for (const auto& pending : pending_)
    stray_ += static_cast<std::uint64_t>(std::max(pending.events - 1, 0));
  drm_.drmDropMaster(fd_);
  drm_.close(fd_);
  fd_ = -1;
}

Json KmsDisplay::describe() const {
  Json set = Json::array();
  for (const auto& setting : settings_) set.push_back(setting.name);
  return {{"backend", "kms"},
          {"card", card_},
          {"output", output_.name},
          {"edid", output_.edid ? Json(output_.edid->id()) : Json()},
          {"size", {output_.size_px.x, output_.size_px.y}},
          {"rate_hz", output_.rate_hz},
          {"lets_levels_through", set},
          {"knows_gamma", knows_gamma_},
          {"proof",
           {{"flip_events", arrived_},
            {"counted_by_time", counted_by_time_},
            {"stray_events", stray_},
            {"read_back", read_back_}}},
          {"restored", is_restored_}};
}

std::vector<std::string> cards() {
  std::vector<std::string> all;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/dri", error))
    if (entry.path().filename().string().starts_with("card")) all.push_back(entry.path().string());
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

std::unique_ptr<Display> kms_display(Libdrm drm) {
  return std::make_unique<KmsDisplay>(std::move(drm));
}

std::unique_ptr<Display> kms_display() {
  const LoadedLibrary library("libdrm.so.2", "libdrm2");
  Libdrm drm;
#define RAYWAVE_FIND(name) library.find(#name, drm.name);
  RAYWAVE_DRM_FUNCTIONS(RAYWAVE_FIND)
#undef RAYWAVE_FIND
  drm.cards = cards;
  drm.open = [](const std::string& card) { return ::open(card.c_str(), O_RDWR | O_CLOEXEC); };
  drm.close = [](int fd) { ::close(fd); };
  drm.map = [](int fd, std::uint64_t bytes, std::uint64_t offset) -> void* {
    void* const place =
        mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, static_cast<off_t>(offset));
    return place == MAP_FAILED ? nullptr : place;
  };
  drm.unmap = [](void* place, std::uint64_t bytes) { munmap(place, bytes); };
  drm.wait = [](int fd, double seconds) {
    const double end_s = now_s() + seconds;
    pollfd waiting{fd, POLLIN, 0};
    for (;;) {
      const double left_s = std::max(end_s - now_s(), 0.0);
      const int ready = poll(&waiting, 1, static_cast<int>(std::ceil(1e3 * left_s)));
      if (ready >= 0 || errno != EINTR) return ready > 0;
    }
  };
  drm.now = now_s;
  drm.sleep_until = sleep_until;
  return kms_display(std::move(drm));
}

#else

std::unique_ptr<Display> kms_display() {
  throw InputError(
      "raywave was built without libdrm; install libdrm-dev and build it again, or give --backend "
      "window");
}

#endif

}  // namespace raywave
