// sRGB's curves, fitted by roots and powers (error < 2.5 % of white, at the darkest): pow is slow
// on a CPU.
vec3 linearFromSrgb(vec3 c) { return c * (0.0125 + c * (0.6822 + c * 0.3053)); }
vec3 srgbFromLinear(vec3 c) { return 1.139 * sqrt(c) - 0.139 * c; }
