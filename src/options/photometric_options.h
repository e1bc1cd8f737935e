// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "options/option_field.h"
#include "sheaf/error.h"
#include "sheaf/io.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// The options of a photometric refinement: each is one entry here and one field of the struct.
const OptionTable<PhotometricOptions>& photometric_fields();

/// The options of reading its folder.
const OptionTable<PhotometricReadOptions>& photometric_read_fields();

/// A refinement from pixels as the command and other languages state it.
struct PhotometricArguments {
  PhotometricReadOptions read;
  PhotometricOptions options;
};
std::vector<BoundOption> options_of(PhotometricArguments& arguments);

/// Errors: ErrorCode::usage, naming the first field that is out of its range.
Result<void> check_fields(const PhotometricOptions& options);

}  // namespace sheaf
