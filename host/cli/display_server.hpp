// SPDX-License-Identifier: Apache-2.0
/// Pictures on the screen of tev (https://github.com/Tom94/tev), which may run on another machine.
#pragma once

#include <span>
#include <string>

#include "host/scene/read_data.hpp"

namespace raywave::cli {

/// Sends a picture as tev's packets CreateImage and UpdateImage, strip by strip; one of the same
/// name is replaced.
///
/// server    --display-server: "localhost:14158"
/// channels  of one size; one, or red, green and blue: linear
/// throws    InputError naming the option when nobody answers there, or stops to listen
void display(const std::string& server, const std::string& name, std::span<const Image> channels);

}  // namespace raywave::cli
