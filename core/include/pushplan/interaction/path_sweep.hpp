// Sweeping a path in portions: what each step costs, and ice that is only looked at near the hull.
#pragma once

#include <span>

#include "pushplan/interaction/ice.hpp"

namespace pushplan {

/// Writes the work on K objects from each of N poses of a robot to the next [kg m]. `swept`, (N,
/// K), holds the objects at each pose.
void step_works(ArrayView<const Pose, 2> swept, std::span<const double> masses,
                std::span<double> works);

/// `IceContacts::sweep` with those floes only that are near a short path; the rest stays. Changes
/// the floes' poses; `out`, (N, K), receives them at each pose of the path, and `works`, (N - 1,),
/// the work from each pose to the next [kg m].
void sweep_near(std::span<const Pose> path, std::span<Pose> poses, const IceBodies& bodies,
                const IceSettings& settings,
                double margin,  // greatest distance from the hull of a floe that is looked at [m]
                ArrayView<Pose, 2> out, std::span<double> works);

}  // namespace pushplan
