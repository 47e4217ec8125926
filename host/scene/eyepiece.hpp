// SPDX-License-Identifier: Apache-2.0
/// What the eye sees through an eyepiece: a thin lens before the hologram ([viewer] eyepiece). It
/// shows the plane z at another distance, given in dioptres: one over the distance, in metres, from
/// the eyepiece to where the eye sees it. 0 D is infinitely far away; below 0 D no eye can focus.
#pragma once

#include "host/scene/scene.hpp"

namespace raywave {

/// The plane that is seen at so many dioptres. With the lens at z = -e, of focal length f,
///   1 / (z + e) = 1 / f + dioptres.
///
/// throws  InputError without an eyepiece, and where there is no such plane
double depth_of_dioptres(const ViewerSpec& viewer, double dioptres);

/// What an eye makes out of the plane z_m: 1 arc minute. Behind a thin lens it sees what is beyond
/// the lens under the angle that it has there, in focus however near it is.
double detail_for_eye_m(const ViewerSpec& viewer, double z_m);

/// The dioptres at which the plane z_m is seen; it must lie beyond the eyepiece, z_m > -e.
double dioptres_of_depth(const ViewerSpec& viewer, double z_m);

}  // namespace raywave
