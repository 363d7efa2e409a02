// Images of the world: where things are drawn, and what is hidden.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "check.hpp"
#include "pushplan/geometry/obstacles.hpp"
#include "pushplan/observation/hidden.hpp"
#include "shapes.hpp"

namespace pushplan {
namespace {

using namespace tests;

constexpr Index kSide = 40;
constexpr ImageView kView{{1.0, 2.0, 0.5 * std::numbers::pi}, 40.0, 40.0, 0.1, 0.1};

struct OwnedImage {
  Image view() { return {pixels.data(), {kSide, kSide}}; }
  std::vector<std::uint8_t> pixels = std::vector<std::uint8_t>(kSide * kSide, 0);
};

/// Where the centre of a pixel is in the world [m]; the window's up is the world's.
Vec2 place_of(std::size_t pixel) {
  const auto row = static_cast<double>(pixel / kSide);
  const auto column = static_cast<double>(pixel % kSide);
  return {1.0 + 0.1 * (column + 0.5 - 20.0), 2.0 - 0.1 * (row + 0.5 - 20.0)};
}

/// Bodies and parts are drawn where they are, and nowhere else.
void pixels_show_what_is_there() {
  Xorshift64Star random(1);
  for (int trial = 0; trial < 50; ++trial) {
    Shapes bodies;
    std::vector<Pose> poses;
    for (int k = 0; k < 4; ++k) {
      bodies.add(convex_shape(random, {0.0, 0.0}, 0.5));
      poses.push_back({between(random, -1.5, 3.5), between(random, -0.5, 4.5), random.uniform()});
    }
    OwnedImage image;
    fill_bodies(image.view(), kView, poses, bodies.polygons(), bodies.radii, 7);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      double depth = 1e9;
      for (std::size_t k = 0; k < 4; ++k) {
        const auto outline = placed(poses[k], bodies.polygons()[static_cast<Index>(k)]);
        depth = std::min(depth, core_distance(place_of(i), outline));
      }
      if (std::abs(depth) > 1e-9) CHECK(image.pixels[i] == (depth < 0.0 ? 7 : 0));
    }
  }
}

/// A raster is read at each pixel; its edge goes on beyond it.
void rasters_are_read_at_pixels() {
  std::array<std::uint8_t, 12> values;
  for (std::size_t i = 0; i < 12; ++i) values[i] = static_cast<std::uint8_t>(10 + i);
  const Raster raster{{values.data(), {3, 4}}, {0.0, 1.0}, 0.5};
  OwnedImage image;
  sample_raster(image.view(), kView, raster);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const Vec2 p = place_of(i);
    const double column = std::clamp(std::floor(p.x / 0.5), 0.0, 3.0);
    const double row = std::clamp(std::floor((p.y - 1.0) / 0.5), 0.0, 2.0);
    const double to_edge =
        std::min(std::abs(std::remainder(p.x, 0.5)), std::abs(std::remainder(p.y - 1.0, 0.5)));
    if (to_edge > 1e-9) CHECK(image.pixels[i] == 10 + static_cast<int>(4.0 * row + column));
  }
}

/// Pixels in the shadow of a wall get the length of the way around it; those in sight stay.
void shadows_show_the_way_round() {
  const Shapes wall({rectangle(0.5, 2.0, 1.5, 2.1)});
  const Vec2 eye{1.0, 1.0};
  std::vector<float> table(20 * 20 * 1, 2.0F);  // 2 m from the one bend to every cell
  const std::array<Index, 1> bends{0};
  const std::array<double, 1> lengths{1.0};
  const Sight sight{wall.polygons(), {table.data(), {20, 20, 1}}, {-1.0, 0.0}, 0.2, bends, lengths};
  OwnedImage image;
  std::ranges::fill(image.pixels, std::uint8_t{1});
  fill_hidden(image.view(), kView, eye, sight, 10.0);
  int hidden = 0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const Vec2 p = place_of(i);
    const bool inside = core_distance(p, wall.polygons()[0]) < 0.0;
    const double at_wall = 1.0 + (p.x - 1.0) / (p.y - 1.0);  // where the line from the eye meets it
    const bool behind = p.y > 2.1 && std::abs(at_wall - 1.0) < 0.5 - 1e-9;
    const bool clear = p.y < 2.0 - 1e-9 || std::abs(at_wall - 1.0) > 0.5 + 1e-9;
    if (behind && !inside) CHECK(image.pixels[i] == 30);
    if (clear && !inside) CHECK(image.pixels[i] == 1);
    hidden += image.pixels[i] == 30;
  }
  CHECK(hidden > 200 && hidden < 800);
}

}  // namespace
}  // namespace pushplan

int main() {
  pushplan::pixels_show_what_is_there();
  pushplan::rasters_are_read_at_pixels();
  pushplan::shadows_show_the_way_round();
  return pushplan::tests::finish();
}
