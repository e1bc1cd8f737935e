// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sheaf/board.h"
#include "sheaf/camera.h"
#include "sheaf/covariance.h"
#include "sheaf/error.h"
#include "sheaf/io.h"
#include "sheaf/loss.h"
#include "sheaf/options.h"
#include "sheaf/photometric.h"
#include "sheaf/problem.h"
#include "sheaf/scene.h"
#include "sheaf/solve.h"
#include "sheaf/solver.h"
#include "sheaf/stop.h"
#include "sheaf/survey.h"
