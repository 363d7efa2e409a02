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

/// Bilinear value of a field, that of its edge beyond it.
double sample(ArrayView<const double, 2> field, double r, double c) {
  r = std::min(std::max(r, 0.0), static_cast<double>(field.extent(0)) - 1.000001);
  c = std::min(std::max(c, 0.0), static_cast<double>(field.extent(1)) - 1.000001);
  const auto i = static_cast<Index>(r);
  const auto j = static_cast<Index>(c);
  const double u = r - static_cast<double>(i);
  const double v = c - static_cast<double>(j);
  const double top = (1.0 - v) * field(i, j) + v * field(i, j + 1);
  return (1.0 - u) * top + u * ((1.0 - v) * field(i + 1, j) + v * field(i + 1, j + 1));
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
  return mass_at({ship.x + bow * std::cos(ship.theta), ship.y + bow * std::sin(ship.theta)});
}

/// Mass ahead of a bow at a place.
double IceCostToGo::mass_at(Vec2 place) const {
  return sample(field, (place.y - low) / cell, (place.x - left) / cell);
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
    for (Index h = 0; h < headings; ++h) {
      const double off = -kSteepest + static_cast<double>(h) * spread;
      const double length = row / std::cos(off);
      const double turns = std::max(1.0, length / radius / spread);
      const double aside = row * std::tan(off) / column;
      const double heading = 0.5 * std::numbers::pi + off;
      const Vec2 to_bow{bow * std::cos(heading), bow * std::sin(heading)};
      const auto turned = [&](double side) {
        return std::min(std::max(static_cast<double>(h) + side * turns, 0.0), last_heading);
      };
      const std::array<double, 3> next{turned(-1.0), turned(0.0), turned(1.0)};
      for (Index c = 0; c < columns; ++c) {
        const double x = left + static_cast<double>(c) * column;
        const double ahead = mass_at({x + to_bow.x, y + to_bow.y});
        double best = std::numeric_limits<double>::infinity();
        for (const double at : next) {
          best = std::min(best, look_up(r + 1, static_cast<double>(c) - aside, at));
        }
        table(r, c, h) = length * (mass + weight * ahead) + best;
      }
    }
  }
}

/// Bilinear value in one row of the table, with a cost of being beside it.
double IceCostToGo::look_up(Index r, double c, double h) const {
  const auto layer = table.row(r);
  const Index columns = layer.extent(0);
  const Index headings = layer.extent(1);
  const auto last_column = static_cast<double>(columns) - 1.0;
  const double beside = std::max(std::max(0.0, -c), c - last_column);
  c = std::min(std::max(c, 0.0), last_column);
  const Index j = std::min(static_cast<Index>(c), columns - 2);
  const Index k = std::min(static_cast<Index>(h), headings - 2);
  const double u = c - static_cast<double>(j);
  const double v = h - static_cast<double>(k);
  const double near = layer(j, k) + v * (layer(j, k + 1) - layer(j, k));
  const double far = layer(j + 1, k) + v * (layer(j + 1, k + 1) - layer(j + 1, k));
  return near + u * (far - near) + kOutside * mass * beside * column;
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
      std::min(std::max((off + kSteepest) * last_heading / (2.0 * kSteepest), 0.0), last_heading);
  const double before = std::max(0.0, -r) * row;  // the ship goes straight up to the first row
  r = std::min(std::max(r, 0.0), last_row);
  const Index i = std::min(static_cast<Index>(r), rows - 2);
  const double a = look_up(i, c, h);
  const double b = look_up(i + 1, c, h);
  return a + (r - static_cast<double>(i)) * (b - a) +
         mass * (before + kOutside * steep * bow);
}

}  // namespace pushplan
