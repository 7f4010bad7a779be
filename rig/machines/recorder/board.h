/* A simulated recorder as a board in a process (rig/machines/board/virtual.h), and what is true of its last record.

   Copyright (C) 2026 the tactileq authors. SPDX-License-Identifier: GPL-3.0-or-later */

#ifndef TQ_BOARD_H
#define TQ_BOARD_H

#include "simulated.h"

#include "../device/virtual.h"

#endif
