# SPDX-License-Identifier: GPL-3.0-or-later
# Debian 12's own package configuration names folders that do not exist. No version is stated here: OpenImageIO asks for 2.2,
# and with the patch beside this file takes 2.1.
find_path(OpenColorIO_INCLUDE_DIR OpenColorIO/OpenColorIO.h REQUIRED)
find_library(OpenColorIO_LIBRARY OpenColorIO REQUIRED)
add_library(OpenColorIO::OpenColorIO UNKNOWN IMPORTED)
set_target_properties(OpenColorIO::OpenColorIO PROPERTIES IMPORTED_LOCATION "${OpenColorIO_LIBRARY}"
                                                          INTERFACE_INCLUDE_DIRECTORIES "${OpenColorIO_INCLUDE_DIR}")
set(OpenColorIO_FOUND TRUE)
