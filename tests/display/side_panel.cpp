// SPDX-License-Identifier: Apache-2.0
// The panel of raywave view without a window: SDL draws into memory, events are made up.
#include "host/display/side_panel.hpp"

#include "tests/support/x_server.hpp"

#ifdef RAYWAVE_IMGUI
#define SDL_MAIN_HANDLED
#include <SDL.h>
#include <imgui.h>

#include "host/display/loaded.hpp"
#endif

namespace raywave {

#ifdef RAYWAVE_IMGUI
namespace {

/// Calls a function of SDL's.
template <class Function, class... Values>
auto sdl(const char* name, Values... values) {
  std::function<Function> function;
  LoadedLibrary("libSDL2-2.0.so.0", "libsdl2-2.0-0").find(name, function);
  return function(values...);
}
#define SDL(name, ...) sdl<decltype(name)>(#name, __VA_ARGS__)

/// What a renderer of SDL's draws.
struct Canvas {
  SDL_Surface* surface;
  SDL_Renderer* renderer;

  explicit Canvas(glm::ivec2 size_px)
      : surface(SDL(SDL_CreateRGBSurfaceWithFormat, 0, size_px.x, size_px.y, 32,
                    SDL_PIXELFORMAT_ARGB8888)),
        renderer(SDL(SDL_CreateSoftwareRenderer, surface)) {
    REQUIRE(renderer);
  }
  ~Canvas() {
    SDL(SDL_DestroyRenderer, renderer);
    SDL(SDL_FreeSurface, surface);
  }
  std::vector<std::uint32_t> pixels() const {
    std::vector<std::uint32_t> all(static_cast<std::size_t>(surface->w) * surface->h);
    REQUIRE(SDL(SDL_RenderReadPixels, renderer, nullptr, SDL_PIXELFORMAT_ARGB8888, all.data(),
                4 * surface->w) == 0);
    for (auto& pixel : all) pixel &= 0xffffff;
    return all;
  }
};

/// A mouse and a keyboard.
struct Person {
  SidePanel& panel;

  bool move(int x, int y, std::uint32_t held = 0) const {
    SDL_Event event{};
    event.motion = {.type = SDL_MOUSEMOTION, .state = held, .x = x, .y = y};
    return panel.takes(event);
  }
  bool press(int x, int y, bool is_down = true) const {
    SDL_Event event{};
    event.button = {.type = is_down ? SDL_MOUSEBUTTONDOWN : SDL_MOUSEBUTTONUP,
                    .button = SDL_BUTTON_LEFT,
                    .x = x,
                    .y = y};
    return panel.takes(event);
  }
  bool click(int x, int y) const {
    const bool is_taken = press(x, y);
    return press(x, y, false) && is_taken;
  }
  bool wheel() const {
    SDL_Event event{};
    event.wheel = {.type = SDL_MOUSEWHEEL, .y = 1};
    return panel.takes(event);
  }
  bool key(SDL_Keycode key) const {
    SDL_Event event{};
    event.key.keysym.sym = key;
    event.type = SDL_KEYDOWN;
    const bool is_taken = panel.takes(event);
    event.type = SDL_KEYUP;
    panel.takes(event);
    panel.draw();
    return is_taken;
  }
  void type(const char* text) const {
    SDL_Event event{};
    event.type = SDL_TEXTINPUT;
    std::snprintf(event.text.text, sizeof event.text.text, "%s", text);
    panel.takes(event);
    panel.draw();
  }
};

/// The middle of a row of fields, with Dear ImGui's margins.
constexpr int row(int number) { return 17 + 23 * number; }

TEST_CASE("what Dear ImGui draws comes out in its place, its colour and its clip rectangle") {
  Canvas canvas({480, 120});
  const auto panel = side_panel(canvas.renderer, [](Fields&) {
    auto& list = *ImGui::GetForegroundDrawList();
    list.PushClipRect({400, 20}, {430, 60});
    list.AddRectFilled({390, 10}, {460, 50}, IM_COL32(255, 128, 0, 255));
    list.PopClipRect();
    list.AddText({440, 70}, IM_COL32_WHITE, "L");
  });
  panel->draw();
  const auto pixels = canvas.pixels();
  int wrong = 0, of_letter = 0;
  for (int y = 0; y < 120; ++y)
    for (int x = SidePanel::width_px; x < 480; ++x) {
      const auto pixel = pixels[static_cast<std::size_t>(480 * y + x)];
      if (x >= 440 && y >= 70)
        of_letter += pixel != 0;
      else
        wrong += pixel != (x >= 400 && x < 430 && y >= 20 && y < 50 ? 0xff8000 : 0);
    }
  CHECK(wrong == 0);
  CHECK(of_letter > 8);
  CHECK(of_letter < 20);  // its box has twice as many
}

TEST_CASE("fields change by mouse and keyboard, which are the panel's over it and in a field") {
  Canvas canvas({800, 300});
  bool is_on = false;
  int presses = 0, changes = 0;
  double number = 5;
  std::size_t chosen = 0;
  const std::vector<std::string> names{"one", "two", "three"};
  const auto panel = side_panel(canvas.renderer, [&](Fields& fields) {
    changes += fields.check("on", is_on);
    presses += fields.button("go");
    changes += fields.numbers("number", {&number, 1}, 0.1, "%.1f");
    changes += fields.choice("choice", chosen, names);
  });
  const Person person{*panel};
  panel->draw();
  CHECK(person.click(17, row(0)));
  CHECK(is_on);
  CHECK(person.click(17, row(1)));
  CHECK(presses == 1);
  CHECK(person.click(60, row(3)));
  panel->draw();
  panel->draw();
  CHECK(person.click(60, row(3) + 9 + 8 + 17 + 8));  // the second of what has opened
  CHECK(chosen == 1);
  CHECK(changes == 2);

  SECTION("a drag that begins in a field is its own, beyond the panel, too") {
    CHECK(person.press(60, row(2)));
    panel->draw();
    CHECK(person.move(160, row(2), SDL_BUTTON_LMASK));
    panel->draw();
    CHECK(person.move(500, row(2), SDL_BUTTON_LMASK));
    panel->draw();
    person.press(500, row(2), false);
    CHECK(std::abs(number - 5 - 0.1 * 440) < 1);
  }
  SECTION("and one that begins beside the panel never is") {
    CHECK_FALSE(person.press(500, 100));
    panel->draw();
    CHECK_FALSE(person.move(60, row(2), SDL_BUTTON_LMASK));
    panel->draw();
    CHECK_FALSE(person.move(160, row(2), SDL_BUTTON_LMASK));
    panel->draw();
    person.press(160, row(2), false);
    CHECK(number == 5);
  }
  SECTION("wheel") {
    person.move(60, row(2));
    CHECK(person.wheel());
    person.move(500, row(2));
    CHECK_FALSE(person.wheel());
  }
  SECTION("Escape closes a list, and nothing else then") {
    person.click(60, row(3));
    CHECK(person.key(SDLK_ESCAPE));
    CHECK_FALSE(person.key(SDLK_ESCAPE));
    CHECK(chosen == 1);
  }
  SECTION("what is typed counts from Enter on, and keys are the field's until then") {
    CHECK_FALSE(person.key(SDLK_h));
    CHECK_FALSE(person.key(SDLK_TAB));
    person.click(60, row(2));
    person.click(60, row(2));
    panel->draw();
    person.type("72");
    CHECK(person.key(SDLK_h));
    CHECK(person.key(SDLK_BACKSPACE));
    CHECK(number == 5);
    CHECK(person.key(SDLK_RETURN));
    CHECK(number == 7);
    CHECK(changes == 3);
    CHECK_FALSE(person.key(SDLK_h));
  }
}

}  // namespace

#else

TEST_CASE("the panel of raywave view") { test::skip("the panel", "libimgui-dev", false); }

#endif

}  // namespace raywave
