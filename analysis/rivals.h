/* Filters that the render bench compares the kernel with, in equally good C. */

#include "kernel.h"
