// SPDX-License-Identifier: Apache-2.0
/// raywave: holograms for SLMs from scenes of meshes (docs/library.md).
///
///     const auto hologram = raywave::render(raywave::load_scene("scene.toml"));
///     hologram.for_slm();  // grey levels, as the SLM is sent them
///
/// Axes, signs and units: types.hpp. Errors: error.hpp; whatever else is thrown is a bug of
/// raywave, or std::bad_alloc.
///
/// Threads: all functions may be called from several threads at a time. Calls on one Renderer or
/// LiveView take turns. Values (Scene, Plan, Hologram, Slm) may be read from several threads, and
/// changed by one. A process that has used raywave must not compute with it after fork(); start a
/// new program instead.
#pragma once

#include <raywave/version.h>

#include <raywave/display.hpp>
#include <raywave/light.hpp>
#include <raywave/live.hpp>
