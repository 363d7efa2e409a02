#include "pushplan/perception/rays.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pushplan/arithmetic.hpp"

namespace pushplan {

void cast_rays(std::span<double> lengths, const Pose& start, const Polygons& outlines) {
  const auto count = static_cast<Index>(lengths.size());
  const double reach = *std::max_element(lengths.begin(), lengths.end());
  const double step = 2.0 * std::numbers::pi / static_cast<double>(count);
  for (Index k = 0; k < outlines.count(); ++k) {
    const Polygon outline = outlines[k];
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Vec2 next = outline[i + 1 < outline.size() ? i + 1 : 0];
      const Vec2 a{outline[i].x - start.x, outline[i].y - start.y};
      const Vec2 b{next.x - start.x, next.y - start.y};
      const Vec2 e{b.x - a.x, b.y - a.y};
      // most edges are out of reach: (reach + edge)^2 is at most 2 (reach^2 + edge^2)
      if (a.x * a.x + a.y * a.y > 2.0 * (reach * reach + e.x * e.x + e.y * e.y)) continue;
      // only the rays between the bearings of the two ends can cross the edge
      const double turn = std::atan2(a.x * b.y - a.y * b.x, a.x * b.x + a.y * b.y);
      const double low = turn >= 0.0 ? std::atan2(a.y, a.x) : std::atan2(b.y, b.x);
      const auto first = static_cast<Index>(std::ceil((low - start.theta) / step - 1e-9));
      const auto last =
          static_cast<Index>(std::floor((low + std::abs(turn) - start.theta) / step + 1e-9));
      for (Index n = first; n <= last; ++n) {
        const double bearing = start.theta + static_cast<double>(n) * step;
        const double across = std::cos(bearing) * e.y - std::sin(bearing) * e.x;
        if (std::abs(across) < 1e-15) continue;
        const double away = (a.x * e.y - a.y * e.x) / across;
        double& length = lengths[static_cast<std::size_t>(floor_mod(n, count))];
        if (0.0 <= away && away < length) length = away;
      }
    }
  }
}

}  // namespace pushplan
