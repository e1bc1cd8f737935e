// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <petscsys.h>

#include <stdexcept>
#include <string>

namespace sheaf {

/// Throws std::runtime_error with PETSc's own words.
inline void petsc_check(PetscErrorCode code) {
  if (code == 0) return;
  const char* text = nullptr;
  PetscErrorMessage(code, &text, nullptr);
  throw std::runtime_error(std::string("PETSc: ") + (text != nullptr ? text : "unknown error"));
}

}  // namespace sheaf
