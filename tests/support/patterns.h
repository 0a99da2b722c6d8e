// Small patterns for tests, as text.
#pragma once

#include <string>

namespace toile::test {

/// Half a front on the fold (y up, mm): 100 wide, 200 high, a curved side, one notch.
inline const char* const half_front = R"(name: sample
units: mm
y: up
pieces:
  front:
    material: jersey
    cut: 1
    fold: centre
    grain: fold
    points:
      a: [0, 0]
      b: [100, 0]
      c: [90, 150]
      d: [40, 200]
      e: [0, 180]
      pocket: [50, 100]
    outline:
      - {name: hem, path: [a, b]}
      - {name: side, path: [b, {curve: [[110, 50], [80, 100]]}, c]}
      - {name: shoulder, path: [c, d]}
      - {name: neck, path: [d, {arc: {through: [15, 185]}}, e]}
      - {name: centre, path: [e, a]}
    lines:
      chest: {kind: placement, path: [[0, 120], [80, 120]]}
    notches:
      waist: {edge: side, distance: 60}
    marks:
      button: {kind: button, at: [0, 90]}
      drill: {kind: drill, at: [50, 100]}
)";

/// A sleeve cut twice (y down, cm), drawn clockwise on the page, with a hole of two curved legs.
inline const char* const sleeve = R"(units: cm
y: down
pieces:
  sleeve:
    cut: 2
    grain: [[0, 10], [0, 0]]
    points:
      back: [-10, 0]
      front: [12, 1]
      wrist_front: [8, 30]
      wrist_back: [-7, 30]
      low: [0, 25]
      high: [0, 15]
    outline:
      - {name: cap, path: [back, {curve: [[-5, -12], [6, -11]]}, front]}
      - {name: seam_front, path: [front, wrist_front]}
      - {name: wrist, path: [wrist_front, wrist_back]}
      - {name: seam_back, path: [wrist_back, back]}
    holes:
      dart:
        - {name: dart_left, path: [low, {curve: [[-2, 20]]}, high]}
        - {name: dart_right, path: [high, {curve: [[2, 20]]}, low]}
    notches:
      pitch: {edge: cap, fraction: 0.25}
      leg: {edge: dart_left, distance: -1}
)";

/// The text with one part replaced; empty if the part is not in it (so that a test cannot pass by mistake).
inline std::string with(std::string text, const std::string& part, const std::string& by) {
  const std::size_t at = text.find(part);
  if (at == std::string::npos) return "";
  return text.replace(at, part.size(), by);
}

}  // namespace toile::test
