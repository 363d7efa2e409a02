#include "pushplan/gtsp/exact.hpp"

#include <algorithm>

#include "layers.hpp"

namespace pushplan::gtsp {
namespace {

/// Lowers `out[j]` to `values[i] + block(i, j)` where that is less, four rows at a time.
void relax(const double* values, const double* block, Index stride, Index size, double* out,
           Index width) {
  Index i = 0;
  for (; i + 3 < size; i += 4) {
    const double* a = block + i * stride;
    const double* b = a + stride;
    const double* c = b + stride;
    const double* d = c + stride;
    for (Index j = 0; j < width; ++j) {
      const double x = std::min(values[i] + a[j], values[i + 1] + b[j]);
      const double y = std::min(values[i + 2] + c[j], values[i + 3] + d[j]);
      out[j] = std::min(out[j], std::min(x, y));
    }
  }
  for (; i < size; ++i) {
    const double* a = block + i * stride;
    for (Index j = 0; j < width; ++j) out[j] = std::min(out[j], values[i] + a[j]);
  }
}

}  // namespace

void fill_subsets(Index low, Index high, ArrayView<double, 3> table,
                  ArrayView<const double, 4> blocks, std::span<const Index> sizes,
                  ArrayView<const double, 2> first) {
  const Index count = first.extent(0);
  const Index width = first.extent(1);
  const Index stride = count * width;  // between rows of a block
  for (Index subset = low; subset < high; ++subset) {
    for (Index d = 0; d < count; ++d) {
      if (((subset >> d) & 1) == 0) continue;
      double* out = &table(subset, d, 0);
      const Index rest = subset ^ (Index{1} << d);
      if (rest == 0) {
        std::copy_n(first.row(d).data(), width, out);
        continue;
      }
      std::fill_n(out, width, kInfinity);
      for (Index c = 0; c < count; ++c) {
        if ((rest >> c) & 1) {
          relax(&table(rest, c, 0), &blocks(c, 0, d, 0), stride, sizes[at(c)], out, width);
        }
      }
    }
  }
}

}  // namespace pushplan::gtsp
