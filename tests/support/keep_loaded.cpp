// Of programs with sanitizers: libraries that are loaded stay loaded. LeakSanitizer looks when a
// program ends; what only a library that is gone by then (a driver of libEGL) pointed at would be a
// leak, and its places in the code without a name.

extern "C" int dlclose(void*) { return 0; }
