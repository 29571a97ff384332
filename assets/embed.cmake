# Writes OUT, a C++ file that holds the text of the files SOURCES (a list): the array NAME of TYPE, as
# HEADER declares it. Run with cmake -P, by afterglow_embed.
set(entries "")
foreach(source ${SOURCES})
  get_filename_component(name ${source} NAME)
  file(READ ${source} text)
  string(APPEND entries "    {\"${name}\", R\"EMBEDDED(${text})EMBEDDED\"},\n")
endforeach()
file(WRITE ${OUT} "// Made by assets/embed.cmake.
#include \"${HEADER}\"

const ${TYPE} ${NAME}[] = {
${entries}    {nullptr, nullptr},
};
")
