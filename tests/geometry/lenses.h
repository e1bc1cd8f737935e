// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sheaf/camera.h"

namespace sheaf::test {

/// Ordinary parameters of a model; what camera_model_test records of COLMAP is made with the same.
inline Camera ordinary(CameraModel model) {
  switch (model) {
    case CameraModel::bal:
      return {model, {500, -0.05, 0.01}};
    case CameraModel::simple_pinhole:
      return {model, {500, 320, 240}};
    case CameraModel::pinhole:
      return {model, {500, 510, 320, 240}};
    case CameraModel::simple_radial:
      return {model, {500, 320, 240, -0.05}};
    case CameraModel::radial:
      return {model, {500, 320, 240, -0.05, 0.01}};
    case CameraModel::opencv:
      return {model, {500, 510, 320, 240, -0.05, 0.01, 0.002, -0.003}};
    case CameraModel::full_opencv:
      return {model, {500, 510, 320, 240, -0.05, 0.01, 0.002, -0.003, 0.004, 0.03, -0.02, 0.01}};
    case CameraModel::opencv_fisheye:
      return {model, {300, 310, 320, 240, 0.03, -0.01, 0.002, -0.0004}};
    case CameraModel::simple_radial_fisheye:
      return {model, {300, 320, 240, -0.02}};
    case CameraModel::radial_fisheye:
      return {model, {300, 320, 240, 0.02, -0.006}};
    case CameraModel::thin_prism_fisheye:
      return {model,
              {300, 310, 320, 240, 0.03, -0.01, 0.002, -0.003, 0.002, -0.0004, 0.001, -0.002}};
    case CameraModel::fov:
      return {model, {300, 310, 320, 240, 0.9}};
    case CameraModel::eucm:
      return {model, {300, 310, 320, 240, 0.65, 1.1}};
    case CameraModel::rad_tan_thin_prism_fisheye:
      return {model,
              {300, 310, 320, 240, 0.03, -0.01, 0.002, -0.0004, 0.00006, -0.000007, -0.003, 0.002,
               0.001, -0.0003, -0.002, 0.0004}};
    case CameraModel::simple_division:
      return {model, {500, 320, 240, -0.08}};
    case CameraModel::division:
      return {model, {500, 510, 320, 240, -0.06}};
    case CameraModel::simple_fisheye:
      return {model, {300, 320, 240}};
    case CameraModel::fisheye:
      return {model, {300, 310, 320, 240}};
    case CameraModel::equirectangular:
      return {model, {640, 480}, 640, 480};
    case CameraModel::radial_k3:
      return {model, {500, 320, 240, -0.05, 0.01, 0.004}};
    case CameraModel::double_sphere:
      return {model, {300, 310, 320, 240, -0.2, 0.6}};
    case CameraModel::ucm:
      return {model, {300, 310, 320, 240, 0.62}};
  }
  return {};
}

}  // namespace sheaf::test
