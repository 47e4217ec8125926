// SPDX-License-Identifier: Apache-2.0
/// What an SLM shows: the light that leaves it, behind the stop of its optics.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/common/npy.hpp"
#include "host/encode/panel.hpp"

namespace raywave {

/// The light behind an SLM of modulus 1, whose carrier, lens and corrections are taken off again:
/// it is to be compared with the field that was encoded. Where the SLM has a stop, light beyond it
/// is missing. Where the SLM is not ideal (docs/slm.md#light-and-panel-as-they-are), light that it
/// leaves undiffracted stands on minus the carrier. FieldStack::source says what is to be added up
/// in pictures.
///
/// levels   one picture per frame, of the panel's size; std::uint16_t where levels have more than 8
///          bits
/// memory   is taken for the light: new memory takes longer to come than light to be computed
/// throws   InputError when a picture has another size
FieldStack shown_field(const Panel& panel, std::span<const std::vector<std::uint8_t>> levels,
                       FieldStack memory = {});
FieldStack shown_field(const Panel& panel, std::span<const std::vector<std::uint16_t>> levels);

/// Keeps the spatial frequencies whose distance from `centre` is at most half of `size` of the
/// band, per axis; the others become zero. The plane is taken as periodic.
///
/// size    share of the band 1 / pitch, 0 to 1; 1 keeps all
/// centre  cycles per pixel
void keep_band(std::span<std::complex<float>> plane, glm::ivec2 plane_size, glm::dvec2 size,
               glm::dvec2 centre);

}  // namespace raywave
