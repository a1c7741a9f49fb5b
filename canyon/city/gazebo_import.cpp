#include "canyon/city/gazebo_export.hpp"
