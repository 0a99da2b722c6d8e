// Two people to make forms of.
#pragma once

#include "toile/form/measurements.h"

#include <cmath>

namespace toile::testing_people {

inline form::Measurements man() {
  form::Measurements m;
  m.chest = 1.0, m.waist = 0.783, m.hips = 0.928, m.seat = 0.977, m.neck = 0.4, m.biceps = 0.318, m.wrist = 0.165;
  m.shoulderToShoulder = 0.43, m.shoulderSlope = 21 * M_PI / 180, m.hpsToWaistBack = 0.46, m.hpsToBust = 0.265;
  m.waistToArmpit = 0.215, m.waistToHips = 0.13, m.waistToSeat = 0.22, m.waistToFloor = 1.085;
  m.shoulderToElbow = 0.32, m.shoulderToWrist = 0.575, m.waistToUpperLeg = 0.27;
  return m;
}

inline form::Measurements woman() {
  form::Measurements m;
  m.chest = 0.92, m.waist = 0.735, m.hips = 0.905, m.seat = 0.99, m.neck = 0.36, m.biceps = 0.283, m.wrist = 0.158;
  m.shoulderToShoulder = 0.395, m.shoulderSlope = 19 * M_PI / 180, m.hpsToWaistBack = 0.42, m.hpsToBust = 0.265;
  m.waistToArmpit = 0.21, m.waistToHips = 0.125, m.waistToSeat = 0.25, m.waistToFloor = 1.045;
  m.shoulderToElbow = 0.33, m.shoulderToWrist = 0.565, m.underbust = 0.78, m.bustSpan = 0.175;
  return m;
}

}  // namespace toile::testing_people
