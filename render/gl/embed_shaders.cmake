# Writes OUT, a C++ file that holds the text of the shaders SOURCES (a list). Run with cmake -P.
set(entries "")
foreach(source ${SOURCES})
  get_filename_component(name ${source} NAME)
  file(READ ${source} text)
  string(APPEND entries "    {\"${name}\", R\"GLSL(${text})GLSL\"},\n")
endforeach()
file(WRITE ${OUT} "// Made by render/gl/embed_shaders.cmake.
#include \"render/gl/shader.hpp\"

namespace afterglow::render {
const EmbeddedShader kEmbeddedShaders[] = {
${entries}    {nullptr, nullptr},
};
}  // namespace afterglow::render
")
