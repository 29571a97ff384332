# What `cmake --install`, `catkin_make install` and `cpack` lay where, in four parts: core (the command
# for stores), robot (what runs on the robot, and what ROS asks of a package), nodes (all other
# programs), dev (to compile behavior trees with).

# Where rosrun looks, and each program beside those it starts.
install(TARGETS afterglow afterglow_store
  RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION} COMPONENT core)
install(TARGETS afterglow_guard recorder_node speaker_node
  RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION} COMPONENT robot)
if(AFTERGLOW_WITH_ROS2)
  install(TARGETS afterglow_ros2_watch ros2_bridge_node
    RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION} COMPONENT robot)
endif()
set(programs afterglow_calibrate afterglow_console afterglow_doctor afterglow_mesh_reader afterglow_play
  afterglow_render afterglow_replay_guard ask_node calibrator_node example_speak
  fake_fetch_node kitting_demo player_node
  projector_node static_transform_node turret_tf_node)
install(TARGETS ${programs} RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION} COMPONENT nodes)
install(CODE "
  set(folder \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CATKIN_GLOBAL_BIN_DESTINATION})
  file(MAKE_DIRECTORY \${folder})
  execute_process(COMMAND \${CMAKE_COMMAND} -E create_symlink
    ../${CATKIN_PACKAGE_BIN_DESTINATION}/afterglow \${folder}/afterglow)" COMPONENT core)
install(CODE "
  execute_process(COMMAND \${CMAKE_COMMAND} -E create_symlink afterglow_console
    \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CATKIN_PACKAGE_BIN_DESTINATION}/console_node)"
  COMPONENT nodes)
install(FILES ${afterglow_man_page} DESTINATION share/man/man1 COMPONENT core)
install(FILES verbs/completion.bash DESTINATION share/bash-completion/completions RENAME afterglow
  COMPONENT core)

# In folders as in the source tree: launch files name each other and the assets by them.
set(share ${CATKIN_PACKAGE_SHARE_DESTINATION})
foreach(name guard record recorder ros2 speaker)
  list(APPEND robot_launch_files launch/${name}.launch)
endforeach()
install(FILES ${robot_launch_files} DESTINATION ${share}/nodes/launch COMPONENT robot)
file(GLOB other_launch_files CONFIGURE_DEPENDS launch/*.launch)
foreach(name ${robot_launch_files})
  list(REMOVE_ITEM other_launch_files ${CMAKE_CURRENT_LIST_DIR}/${name})
endforeach()
install(FILES ${other_launch_files} DESTINATION ${share}/nodes/launch COMPONENT nodes)
set(assets ${PROJECT_SOURCE_DIR}/assets)
install(FILES ${assets}/afterglow.rviz ${assets}/fetch.urdf ${assets}/projector.yaml
  ${assets}/questions.yaml DESTINATION ${share}/assets COMPONENT nodes)
install(DIRECTORY ${assets}/demo ${assets}/examples ${assets}/robots
  DESTINATION ${share}/assets COMPONENT nodes USE_SOURCE_PERMISSIONS)

# ------------------------------------------------------------------------------------ .deb packages
if(NOT CMAKE_SOURCE_DIR STREQUAL PROJECT_SOURCE_DIR)
  return()  # in a catkin workspace, which is installed as a whole
endif()
# nodes/setup --deb. What is installed by no component of ours, ROS's messages and the Python module, is
# the robot's.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME afterglow)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The Afterglow developers <maintainers@afterglow.invalid>")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/deb)
set(CPACK_PACKAGING_INSTALL_PREFIX ${CMAKE_INSTALL_PREFIX})
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL core robot nodes dev)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_COMPONENT_NODES_DEPENDS core robot)
set(CPACK_COMPONENT_DEV_DEPENDS robot)
set(CPACK_COMPONENT_CORE_DESCRIPTION "Stores of robots' behaviors: the command afterglow")
set(CPACK_COMPONENT_ROBOT_DESCRIPTION "Recorder, guard and speaker of Afterglow, for the robot")
set(CPACK_COMPONENT_NODES_DESCRIPTION
  "Projector-based AR for robots, with replay: projector, player, calibration")
set(CPACK_COMPONENT_DEV_DESCRIPTION "Records behavior trees with Afterglow: headers")
# What dpkg-shlibdeps does not see. ROS of Debian has its Python in packages of their own.
function(afterglow_ros_packages variable)
  set(names ${ARGN})
  if(DEFINED ENV{ROS_DISTRO})
    list(TRANSFORM names REPLACE "^(python3-|lib)(.*)(-dev)?$" "ros-$ENV{ROS_DISTRO}-\\2")
    list(TRANSFORM names REPLACE "-dev$" "")
  endif()
  string(REPLACE ";" ", " names "${names}")
  set(${variable} ${names} PARENT_SCOPE)
endfunction()
afterglow_ros_packages(CPACK_DEBIAN_ROBOT_PACKAGE_DEPENDS
  python3-actionlib python3-actionlib-msgs python3-rospy python3-std-msgs)
afterglow_ros_packages(CPACK_DEBIAN_ROBOT_PACKAGE_RECOMMENDS python3-roslaunch)
string(APPEND CPACK_DEBIAN_ROBOT_PACKAGE_RECOMMENDS ", afterglow-core, alsa-utils | pulseaudio-utils")
set(CPACK_DEBIAN_NODES_PACKAGE_DEPENDS fonts-dejavu-core)
set(CPACK_DEBIAN_NODES_PACKAGE_RECOMMENDS ffmpeg)
afterglow_ros_packages(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
  libactionlib-msgs-dev libroscpp-dev libstd-msgs-dev)
include(CPack)
