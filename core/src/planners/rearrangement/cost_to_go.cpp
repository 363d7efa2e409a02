#include "pushplan/planners/rearrangement/cost_to_go.hpp"

#include <algorithm>

#include "pushplan/arithmetic.hpp"

namespace pushplan::rearrangement {

void fill_cost_to_go(ArrayView<const double, 2> costs, std::span<const Index> delivers,
                     Index objects, const CostToGo& table) {
  const Index count = static_cast<Index>(delivers.size());
  const Index every = (Index{1} << objects) - 1;
  std::fill_n(table.costs.data(), table.costs.size(), kInfinity);
  std::fill_n(table.following.data(), table.following.size(), Index{-1});
  std::ranges::fill(table.costs.row(every), 0.0);
  for (Index done = every - 1; done >= 0; --done) {
    for (Index last = 0; last <= count; ++last) {
      const bool is_start = last == count;
      if (is_start ? done != 0 : (delivers[static_cast<std::size_t>(last)] & ~done) != 0) continue;
      double best = kInfinity;
      for (Index push = 0; push < count; ++push) {
        const Index then = delivers[static_cast<std::size_t>(push)] | done;
        if (then == done) continue;
        const double total = costs(last, push) + table.costs(then, push);
        if (total < best) {
          best = total;
          table.following(done, last) = push;
        }
      }
      table.costs(done, last) = best;
    }
  }
}

}  // namespace pushplan::rearrangement
