// Paths of random trees around a coarse path, one tree after the other, and other ways to begin.
#pragma once

#include "guided_drive.hpp"

namespace pushplan {

class TreePaths {
 public:
  explicit TreePaths(PathImprover& improver);

  /// Changes the start at once where no forward arc leads away from it.
  Task<void> look_ahead();
  /// Begins in another way, after what was tried has failed. A robot that turns on the spot begins
  /// with a turn and without it, by turns; where neither leads on and it can reverse, with a drive
  /// to where it can turn about. A car that can reverse may do so, by two turning radii and twice as
  /// far each time. The first time it is found out whether the robot is boxed in.
  Task<void> change_start();
  /// Looks farther from the coarse path, as the way out may be the other way.
  void relax();
  /// The path of a new tree, around a coarse path that trades its length against a weight of pushing.
  Task<std::optional<Candidate>> grow(double push_weight);
  /// The turn of a robot that turns on the spot towards the first leg of the shortest path, after
  /// what it does before; none for others, or where it brings nothing. Objects are pushed aside.
  Task<std::optional<Lead>> start_turn(Lead before);
  /// The first path in a window.
  Task<void> search_window();

  bool sealed() const { return sealed_; }      // certainly no path leads to the goal
  bool boxed_in() const { return boxed_in_; }  // the robot cannot even get away

 private:
  const Robot& robot() const { return improver_.robot(); }
  ExtraMoves moves() const { return {robot().reverses(), robot().turns_on_spot()}; }
  Room bare_room() const;
  Task<bool> closed(RoomExploration& search);
  Task<bool> gets_away();
  Task<double> first_heading(Vec2 from);
  Task<std::optional<Lead>> drive_to_turn();
  Task<std::vector<Vec2>> coarse_path(double push_weight);

  PathImprover& improver_;
  Session& session_;
  double fraction_;  // of the targets, that are near the coarse path
  std::vector<Vec2> exact_{};      // a path around the walls alone, where the coarse grid has none
  bool sealed_ = false;
  bool boxed_in_ = false;
  double backward_ = 0.0;  // greatest distance by which paths of trees may lead back [m]
};

}  // namespace pushplan
