// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/loss.h"

namespace sheaf {

const char* to_string(LossKind kind) {
  switch (kind) {
    case LossKind::none:
      break;
    case LossKind::huber:
      return "huber";
    case LossKind::soft_l1:
      return "soft-l1";
    case LossKind::cauchy:
      return "cauchy";
    case LossKind::tukey:
      return "tukey";
    case LossKind::geman_mcclure:
      return "geman-mcclure";
  }
  return "none";
}

double tuning_constant(LossKind kind) {
  switch (kind) {
    case LossKind::none:
      break;
    case LossKind::huber:
      return 1.501141083526;
    case LossKind::soft_l1:
      return 1.309427255514;
    case LossKind::cauchy:
      return 2.548637623950;
    case LossKind::tukey:
      return 5.122986089953;
    case LossKind::geman_mcclure:
      return 4.095552337074;
  }
  return 1;
}

bool is_convex(LossKind kind) {
  return kind == LossKind::none || kind == LossKind::huber || kind == LossKind::soft_l1;
}

}  // namespace sheaf
