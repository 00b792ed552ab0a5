// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "engine/dense/surface_mesh.h"
#include "engine/map/map_snapshot.h"

namespace docent::engine {

// The light in the room of a map, as far as its surfaces show it. Brightness is linear; 1 is the largest
// value of an image with the mean exposure of the keyframes.
struct LightEstimate {
  // Of a white diffuse surface by its normal in the map, light from all sides included: coefficients of the
  // real spherical harmonics of order 2 (SphericalHarmonics).
  Eigen::Matrix<double, 9, 1> brightness = Eigen::Matrix<double, 9, 1>::Zero();
  // The main direction; unit vector in the map. Up where it is not known.
  Eigen::Vector3d to_light = -Eigen::Vector3d::UnitY();
  // The part of the brightness of a surface that faces the main light that comes from it. 0 where the main
  // direction is not known: light then comes from all sides, and more from above.
  double direct = 0;

  double BrightnessOf(const Eigen::Vector3d& normal) const;
};

// Polynomials in a unit vector: 1, y, z, x, xy, yz, 3z²-1, xz, x²-y².
Eigen::Matrix<double, 9, 1> SphericalHarmonics(const Eigen::Vector3d& direction);

// Options with their origin.
struct LightOptions {
  int max_keyframes = 40;        // Evenly chosen among more; bounds time.
  int max_width_px = 200;        // The finest pyramid level that is not wider than this is used.
  std::size_t samples = 20'000;  // Points of the surfaces, evenly by area.
  // Surfaces within this distance, relative to the median depth of the keyframes, are compared: they are most
  // often of one thing.
  double neighbourhood = 0.08;
  double min_angle_deg = 20;             // Between the normals of surfaces that are compared.
  std::size_t pairs_per_place = 48;      // Comparisons in one neighbourhood; bounds the weight of a place.
  std::size_t min_pairs = 300;           // With fewer, the direction is not known.
  double max_direction_spread_deg = 20;  // Of estimates from halves of the places; with more it is not known.
  std::size_t min_samples = 500;         // With fewer, nothing is known: 2 % of them set what is white.
  // What a surface that faces up receives more than the mean where the direction is not known, relative to
  // the mean. Measured in the simulator with 0 and 0.3 (docs/decisions/room-light.md).
  double more_from_above = 0.3;
};

// Compares surfaces that are close to each other and face in different directions: they are most often of the
// same material, so that the ratio of their brightness is that of the light that they receive, whatever their
// colour. Where there are too few such surfaces, or where parts of them do not agree on the main direction,
// only the brightness of white things is used. Empty where no surface was seen. Takes about a second.
// Deterministic.
std::optional<LightEstimate> EstimateLight(const MapSnapshot& map, const SurfaceMesh& mesh,
                                           const LightOptions& options = {});

}  // namespace docent::engine
