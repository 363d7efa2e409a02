// A drive along the shortest path around the walls, without a search, or with one in small windows.
#pragma once

#include "path_improver.hpp"

namespace pushplan {

/// True if the goal is more edges of a tree away than one grows in some milliseconds.
bool is_far(const PathImprover& improver);

/// Poses along the shortest path from the lead on: some at each bend, one past its end. `wide` keeps
/// well away from walls. None where there is no such path; objects are in the way if `around`.
Task<std::vector<Pose>> guide(PathImprover& improver, bool wide, bool around = false);

/// Tries to drive along the shortest path, wide of the walls or near to them. True where that is a
/// path without a jam.
Task<bool> along_guide(PathImprover& improver, bool around = false);

/// The same; where the curves along it fail and the goal is far, windows are searched. What is found
/// of a way to a far goal is shortcut at once, as trees are slow to find better ones.
Task<void> warm_start(PathImprover& improver);

}  // namespace pushplan
