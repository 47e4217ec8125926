// SPDX-License-Identifier: Apache-2.0
/// The errors that a user sees, as the installed headers declare them.
#pragma once

#include "host/include/raywave/error.hpp"
