#pragma once

#include "canyon/base/read_report.hpp"
