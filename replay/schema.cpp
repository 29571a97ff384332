#include "replay/schema.hpp"
