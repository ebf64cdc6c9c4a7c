// The figures of a report, each as one SVG. An empty string means that the logs hold nothing to draw.
#pragma once

#include <string>

#include "tools/report_data.h"

namespace wasp::tools {

/// Truth, setpoint, control's estimate and every behaviour that speaks of height, over time; mission phases shaded.
std::string altitude_figure(const ReportData& data);
/// How far each estimate of height is from truth at the same instant: the behaviours' cues and control's own.
std::string height_error_figure(const ReportData& data);
/// Truth from above: east to the right, north up, equal scales.
std::string path_figure(const ReportData& data);
/// Roll and pitch as commanded and as the autopilot estimates them.
std::string attitude_figure(const ReportData& data);
std::string thrust_figure(const ReportData& data);

}  // namespace wasp::tools
