// SPDX-License-Identifier: Apache-2.0
// Dear ImGui's own back ends would link SDL, which is loaded here when a window is asked for.
#include "host/display/side_panel.hpp"

#ifdef RAYWAVE_IMGUI
#define SDL_MAIN_HANDLED
#include <SDL.h>
#include <imgui.h>

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

#include "host/common/error.hpp"
#include "host/display/display.hpp"
#include "host/display/loaded.hpp"
#endif

namespace raywave {

#ifdef RAYWAVE_IMGUI
namespace {

#define RAYWAVE_SDL_FUNCTIONS(use)                                                             \
  use(SDL_GetError) use(SDL_GetModState) use(SDL_GetRendererOutputSize) use(SDL_CreateTexture) \
      use(SDL_DestroyTexture) use(SDL_UpdateTexture) use(SDL_SetTextureBlendMode)              \
          use(SDL_RenderSetClipRect) use(SDL_RenderGeometryRaw)

struct Sdl {
#define RAYWAVE_MEMBER(name) std::function<std::remove_pointer_t<decltype(&::name)>> name;
  RAYWAVE_SDL_FUNCTIONS(RAYWAVE_MEMBER)
#undef RAYWAVE_MEMBER
};

/// What is used of them to edit a field.
constexpr std::pair<SDL_Keycode, ImGuiKey> editing_keys[] = {
    {SDLK_LEFT, ImGuiKey_LeftArrow},
    {SDLK_RIGHT, ImGuiKey_RightArrow},
    {SDLK_HOME, ImGuiKey_Home},
    {SDLK_END, ImGuiKey_End},
    {SDLK_DELETE, ImGuiKey_Delete},
    {SDLK_BACKSPACE, ImGuiKey_Backspace},
    {SDLK_RETURN, ImGuiKey_Enter},
    {SDLK_KP_ENTER, ImGuiKey_Enter},
    {SDLK_ESCAPE, ImGuiKey_Escape},
    {SDLK_TAB, ImGuiKey_Tab},
    {SDLK_a, ImGuiKey_A},
};

class ImGuiPanel : public SidePanel, private Fields {
public:
  ImGuiPanel(Sdl sdl, SDL_Renderer* renderer, FillPanel fill)
      : sdl_(std::move(sdl)),
        renderer_(renderer),
        fill_(std::move(fill)),
        context_(ImGui::CreateContext()) {
    auto& io = ImGui::GetIO();
    io.IniFilename = io.LogFilename = nullptr;
    io.ConfigInputTextCursorBlink = false;  // nothing is drawn while nothing happens
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    io.Fonts->GetTexDataAsRGBA32(&pixels, &width, &height);
    font_ = sdl_.SDL_CreateTexture(renderer_, SDL_PIXELFORMAT_ABGR8888, SDL_TEXTUREACCESS_STATIC,
                                   width, height);
    if (!font_ || sdl_.SDL_UpdateTexture(font_, nullptr, pixels, 4 * width) != 0 ||
        sdl_.SDL_SetTextureBlendMode(font_, SDL_BLENDMODE_BLEND) != 0)
      fail();
    io.Fonts->SetTexID(reinterpret_cast<ImTextureID>(font_));
  }
  ~ImGuiPanel() override {
    ImGui::DestroyContext(context_);
    if (font_) sdl_.SDL_DestroyTexture(font_);
  }

  /// What is pressed and released between two pictures would be lost: each has a frame of its own,
  /// which is not drawn.
  bool takes(const SDL_Event& event) override {
    auto& io = ImGui::GetIO();
    const bool is_down = event.type == SDL_MOUSEBUTTONDOWN || event.type == SDL_KEYDOWN;
    switch (event.type) {
      case SDL_MOUSEMOTION:
        move_to({static_cast<float>(event.motion.x), static_cast<float>(event.motion.y)});
        return io.WantCaptureMouse || (event.motion.state == 0 && event.motion.x < width_px);
      case SDL_MOUSEBUTTONDOWN:
      case SDL_MOUSEBUTTONUP:
        move_to({static_cast<float>(event.button.x), static_cast<float>(event.button.y)});
        lay_out();  // it has got here before
        if (event.button.button == SDL_BUTTON_LEFT) io.MouseDown[0] = is_down;
        if (event.button.button == SDL_BUTTON_RIGHT) io.MouseDown[1] = is_down;
        lay_out();
        return io.WantCaptureMouse;
      case SDL_MOUSEWHEEL:
        io.MouseWheel += static_cast<float>(event.wheel.y);
        lay_out();
        return io.WantCaptureMouse;
      case SDL_TEXTINPUT:
        io.AddInputCharactersUTF8(event.text.text);
        return io.WantTextInput;
      case SDL_KEYDOWN:
      case SDL_KEYUP:
        if (is_down && !ImGui::IsAnyItemActive() &&
            !ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup))
          return false;
        press(event.key.keysym.sym, is_down);
        lay_out();
        return true;
      default:
        return false;
    }
  }

  void draw() override {
    lay_out();
    const auto& drawn = *ImGui::GetDrawData();
    for (int i = 0; i < drawn.CmdListsCount; ++i)
      for (const auto& command : drawn.CmdLists[i]->CmdBuffer) draw(*drawn.CmdLists[i], command);
    sdl_.SDL_RenderSetClipRect(renderer_, nullptr);
  }

private:
  [[noreturn]] void fail() { throw DeviceError(std::string("the panel: ") + sdl_.SDL_GetError()); }

  void move_to(ImVec2 place) { ImGui::GetIO().MousePos = place; }

  // Keys of Dear ImGui before and after 1.89
  static void press(SDL_Keycode pressed, bool is_down) {
    for (const auto& [code, key] : editing_keys) {
      if (code != pressed) continue;
#if IMGUI_VERSION_NUM >= 18900
      ImGui::GetIO().AddKeyEvent(key, is_down);
#else
      ImGui::GetIO().KeyMap[key] = key;
      ImGui::GetIO().KeysDown[key] = is_down;
#endif
    }
  }

  void lay_out() {
    auto& io = ImGui::GetIO();
    const bool has_ctrl = (sdl_.SDL_GetModState() & KMOD_CTRL) != 0;
#if IMGUI_VERSION_NUM >= 18900
    io.AddKeyEvent(ImGuiMod_Ctrl, has_ctrl);
#else
    io.KeyCtrl = has_ctrl;
#endif
    glm::ivec2 window(1);
    sdl_.SDL_GetRendererOutputSize(renderer_, &window.x, &window.y);
    io.DisplaySize = {static_cast<float>(window.x), static_cast<float>(window.y)};
    const double time_s = now_s();
    io.DeltaTime = std::max(static_cast<float>(time_s - std::exchange(laid_out_s_, time_s)), 1e-6F);
    ImGui::NewFrame();
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize({width_px, io.DisplaySize.y});
    ImGui::Begin("panel", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoNav);
    ImGui::PushItemWidth(0.62F * width_px);
    fill_(*this);
    ImGui::PopItemWidth();
    ImGui::End();
    ImGui::Render();
  }

  void draw(const ImDrawList& list, const ImDrawCmd& command) {
    const auto& clip = command.ClipRect;  // its corners
    const SDL_Rect seen{static_cast<int>(clip.x), static_cast<int>(clip.y),
                        static_cast<int>(clip.z - clip.x), static_cast<int>(clip.w - clip.y)};
    if (seen.w <= 0 || seen.h <= 0) return;
    sdl_.SDL_RenderSetClipRect(renderer_, &seen);
    constexpr int size = sizeof(ImDrawVert);
    const auto* first = list.VtxBuffer.Data + command.VtxOffset;
    if (sdl_.SDL_RenderGeometryRaw(
            renderer_, reinterpret_cast<SDL_Texture*>(command.GetTexID()), &first->pos.x, size,
            reinterpret_cast<const SDL_Color*>(&first->col), size, &first->uv.x, size,
            list.VtxBuffer.Size - static_cast<int>(command.VtxOffset),
            list.IdxBuffer.Data + command.IdxOffset, static_cast<int>(command.ElemCount),
            sizeof(ImDrawIdx)) != 0)
      fail();
  }

  void text(const std::string& words) override { ImGui::TextWrapped("%s", words.c_str()); }
  void beside() override { ImGui::SameLine(); }
  bool button(const char* name) override { return ImGui::Button(name); }
  bool check(const char* name, bool& value) override { return ImGui::Checkbox(name, &value); }
  bool choice(const char* name, std::size_t& chosen, std::span<const std::string> of) override {
    const auto before = chosen;
    if (!ImGui::BeginCombo(name, of[chosen].c_str())) return false;
    for (std::size_t i = 0; i < of.size(); ++i)
      if (ImGui::Selectable(of[i].c_str(), i == before)) chosen = i;
    if (ImGui::IsKeyPressed(ImGuiKey_Escape)) ImGui::CloseCurrentPopup();
    ImGui::EndCombo();
    return chosen != before;
  }
  bool numbers(const char* name, std::span<double> values, double step, const char* how) override {
    std::vector<double> edited(values.begin(), values.end());
    if (!has_settled(ImGui::DragScalarN(name, ImGuiDataType_Double, edited.data(),
                                        static_cast<int>(edited.size()), static_cast<float>(step),
                                        nullptr, nullptr, how)))
      return false;
    std::copy(edited.begin(), edited.end(), values.begin());
    return true;
  }
  bool slider(const char* name, double& value, glm::dvec2 range, const char* how) override {
    auto edited = value;
    if (!has_settled(
            ImGui::SliderScalar(name, ImGuiDataType_Double, &edited, &range.x, &range.y, how)))
      return false;
    value = edited;
    return true;
  }
  /// Not while it is typed.
  static bool has_settled(bool is_changed) {
    return is_changed && !(ImGui::IsItemActive() && ImGui::GetIO().WantTextInput);
  }

  Sdl sdl_;
  SDL_Renderer* renderer_;
  FillPanel fill_;
  ImGuiContext* context_;
  SDL_Texture* font_ = nullptr;
  double laid_out_s_ = now_s();
};

}  // namespace

std::unique_ptr<SidePanel> side_panel(SDL_Renderer* renderer, FillPanel fill) {
  const LoadedLibrary library("libSDL2-2.0.so.0", "libsdl2-2.0-0");
  Sdl sdl;
#define RAYWAVE_FIND(name) library.find(#name, sdl.name);
  RAYWAVE_SDL_FUNCTIONS(RAYWAVE_FIND)
#undef RAYWAVE_FIND
  return std::make_unique<ImGuiPanel>(std::move(sdl), renderer, std::move(fill));
}

#else

std::unique_ptr<SidePanel> side_panel(SDL_Renderer*, FillPanel) { return nullptr; }

#endif

}  // namespace raywave
