#include "render/scene/scene.hpp"
