#include "calib/lens.hpp"
