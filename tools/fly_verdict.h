// The verdict on a finished run: results against their bars, run.json, report.html, the tables on the terminal.
#pragma once

#include "tools/fly_run.h"

namespace wasp::tools {

/// Judges from the logs, writes run.json and the report, prints. Exit code 0 only if every bar is met.
int conclude(Run& run, int flight_code, bool interrupted);

}  // namespace wasp::tools
