// Contact points between two convex polygons.
#pragma once

#include <array>
#include <utility>

#include "pushplan/geometry/pose.hpp"

namespace pushplan {

/// A point where one body holds another.
struct Contact {
  Vec2 point;   // [m]
  Vec2 normal;  // unit, from the first body to the second
  double gap;   // [m], negative where they overlap
};

/// At most two of them, which is what two convex polygons have.
struct Contacts {
  std::array<Contact, 2> points;
  int count = 0;
};

/// The widest signed gap [m] of `b` along an edge normal of `a`, and the corner where that edge
/// begins. Ends at the first gap wider than 0.
std::pair<double, Index> least_overlap(Polygon a, Polygon b);

/// The points where two polygons overlap; none where they only touch.
Contacts contacts(Polygon a, Polygon b);

/// The points where they overlap, touch, or are less than `margin` [m] apart.
Contacts near_contacts(Polygon a, Polygon b, double margin);

}  // namespace pushplan
