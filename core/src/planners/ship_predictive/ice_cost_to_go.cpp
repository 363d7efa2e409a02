#include "pushplan/planners/ship_predictive/ice_cost_to_go.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "pushplan/arithmetic.hpp"

namespace pushplan {
namespace {

constexpr double kGain = 1.5;  // work of a metre per mass ahead of the bow
// cost of each metre beside the channel against a metre of travel: finite, so that costs can be
// interpolated, and the search looks for the way back where it has to start there
constexpr double kOutside = 300.0;

double median(std::span<const double> values) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const std::size_t half = sorted.size() / 2;
  if (sorted.size() % 2 == 1) return sorted[half];
  return (sorted[half - 1] + sorted[half]) / 2.0;
}

/// A place in a grid: between a line of it and the next one.
struct Between {
  Index line;
  double part;  // of the way to the next line
};

/// A place in a field of so many lines, on its edge if it lies beyond.
Between place_in_field(double at, Index lines) {
  // of NaN and 0 this order keeps the 0, here and below
  const double inside = std::min(std::max(0.0, at), static_cast<double>(lines) - 1.000001);
  const auto line = static_cast<Index>(inside);
  return {line, inside - static_cast<double>(line)};
}

/// A place in a table, which has to lie within it.
Between place_in_table(double at, Index lines) {
  const Index line = std::min(static_cast<Index>(at), lines - 2);
  return {line, at - static_cast<double>(line)};
}

/// Bilinear value of a field.
double sample(ArrayView<const double, 2> field, Between row, Between column) {
  const double* near = &field(row.line, column.line);
  const double* far = near + field.extent(1);
  const double u = row.part;
  const double v = column.part;
  return (1.0 - u) * ((1.0 - v) * near[0] + v * near[1]) + u * ((1.0 - v) * far[0] + v * far[1]);
}

/// A place among the columns of a table: its nearest one within it, and how far that is.
struct TableColumn {
  Between column;
  double beside;  // [columns]
};

TableColumn column_of(double at, Index columns) {
  const auto last = static_cast<double>(columns) - 1.0;
  const double beside = std::max(std::max(0.0, -at), at - last);
  return {place_in_table(std::min(std::max(0.0, at), last), columns), beside};
}

/// Bilinear value in one row of a table.
double look_up(ArrayView<const double, 2> layer, Between column, Between heading) {
  const double* first = &layer(column.line, heading.line);
  const double* second = first + layer.extent(1);
  const double near = first[0] + heading.part * (first[1] - first[0]);
  const double far = second[0] + heading.part * (second[1] - second[0]);
  return near + column.part * (far - near);
}

}  // namespace

void IceCostToGo::fill_field(const FloeMasses& floes) const {
  std::fill_n(field.data(), field.size(), 0.0);
  const Index rows = field.extent(0);
  const Index columns = field.extent(1);
  for (std::size_t k = 0; k < floes.poses.size(); ++k) {
    const double reach = floes.half_beam + floes.radii[k];
    const double x = (floes.poses[k].x - left) / cell;
    const double y = (floes.poses[k].y - low) / cell;
    const double span = reach / cell;
    const Index last_row = std::min(rows - 1, floor_index(y + span));
    const Index last_column = std::min(columns - 1, floor_index(x + span));
    for (Index r = std::max(Index{0}, ceil_index(y - span)); r <= last_row; ++r) {
      const double down = static_cast<double>(r) - y;
      for (Index c = std::max(Index{0}, ceil_index(x - span)); c <= last_column; ++c) {
        const double across = static_cast<double>(c) - x;
        const double square = (down * down + across * across) / (span * span);
        if (square < 1.0) field(r, c) += floes.masses[k] * (1.0 - square);
      }
    }
  }
  if (floes.masses.empty()) return;
  const double typical = median(floes.masses);
  for (Index i = 0; i < field.size(); ++i) {
    double& value = field.data()[i];
    value *= kGain * (1.0 + value / typical);
  }
}

double IceCostToGo::mass_ahead(const Pose& ship) const {
  const double x = ship.x + bow * std::cos(ship.theta);
  const double y = ship.y + bow * std::sin(ship.theta);
  return sample(field, place_in_field((y - low) / cell, field.extent(0)),
                place_in_field((x - left) / cell, field.extent(1)));
}

void IceCostToGo::fill_table() const {
  const Index rows = table.extent(0);
  const Index columns = table.extent(1);
  const Index headings = table.extent(2);
  const auto last_heading = static_cast<double>(headings - 1);
  const double spread = 2.0 * kSteepest / last_heading;
  const auto goal_row = table.row(rows - 1);
  std::fill_n(goal_row.data(), goal_row.size(), 0.0);
  for (Index r = rows - 2; r >= 0; --r) {
    const double y = low + static_cast<double>(r) * row;
    const auto next_row = table.row(r + 1);
    for (Index h = 0; h < headings; ++h) {
      const double off = -kSteepest + static_cast<double>(h) * spread;
      const double length = row / std::cos(off);
      const double turns = std::max(1.0, length / radius / spread);
      const double aside = row * std::tan(off) / column;
      const auto turned = [&](double side) {
        const double at = static_cast<double>(h) + side * turns;
        return place_in_table(std::min(std::max(0.0, at), last_heading), headings);
      };
      const std::array<Between, 3> next_headings{turned(-1.0), turned(0.0), turned(1.0)};
      const double heading = 0.5 * std::numbers::pi + off;
      const Vec2 to_bow{bow * std::cos(heading), bow * std::sin(heading)};
      const Between bow_row = place_in_field((y + to_bow.y - low) / cell, field.extent(0));
      for (Index c = 0; c < columns; ++c) {
        const double x = left + static_cast<double>(c) * column;
        const double ahead =
            sample(field, bow_row, place_in_field((x + to_bow.x - left) / cell, field.extent(1)));
        const TableColumn next = column_of(static_cast<double>(c) - aside, columns);
        const double outside = kOutside * mass * next.beside * column;
        double best = std::numeric_limits<double>::infinity();
        for (const Between& next_heading : next_headings) {
          best = std::min(best, look_up(next_row, next.column, next_heading) + outside);
        }
        table(r, c, h) = length * (mass + weight * ahead) + best;
      }
    }
  }
}

double IceCostToGo::cost_to_go(const Pose& ship) const {
  const Index rows = table.extent(0);
  const auto last_row = static_cast<double>(rows) - 1.0;
  const auto last_heading = static_cast<double>(table.extent(2)) - 1.0;
  const double off = ship.theta - 0.5 * std::numbers::pi;
  const double c = (ship.x - left) / column;
  double r = (ship.y - low) / row;
  // each radian beyond the headings of the table counts like a path beside the channel
  const double steep = std::max(0.0, std::abs(off) - kSteepest);
  const double h =
      std::min(std::max(0.0, (off + kSteepest) * last_heading / (2.0 * kSteepest)), last_heading);
  const double before = std::max(0.0, -r) * row;  // the ship goes straight up to the first row
  r = std::min(std::max(0.0, r), last_row);
  const Index i = std::min(static_cast<Index>(r), rows - 2);
  const auto [place, beside] = column_of(c, table.extent(1));
  const Between heading = place_in_table(h, table.extent(2));
  const double outside = kOutside * mass * beside * column;
  const double a = look_up(table.row(i), place, heading) + outside;
  const double b = look_up(table.row(i + 1), place, heading) + outside;
  return a + (r - static_cast<double>(i)) * (b - a) + mass * (before + kOutside * steep * bow);
}

}  // namespace pushplan
