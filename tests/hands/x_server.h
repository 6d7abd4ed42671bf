// SPDX-License-Identifier: Apache-2.0
// tests: a private X server (Xvfb) for a simulated user of the window. On a machine with a desktop a test must not
// take the mouse away.
#pragma once
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace catgut {

inline bool on_path(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
}

struct XServer {
  pid_t pid = -1;
  std::string display;  // ":7"; empty: it does not start here
  XServer() {
    int out[2];
    if (pipe(out) != 0) return;
    pid = fork();
    if (pid == 0) {
      dup2(out[1], 3);
      if (!std::freopen("/dev/null", "w", stderr)) _exit(98);
      execlp("Xvfb", "Xvfb", "-displayfd", "3", "-screen", "0", "1280x800x24", "-noreset", "-nolisten", "tcp", nullptr);
      _exit(99);
    }
    close(out[1]);
    std::string number;
    for (char c; read(out[0], &c, 1) == 1 && c != '\n';) number += c;  // Xvfb reports its display, or ends
    close(out[0]);
    if (!number.empty()) display = ":" + number;
  }
  ~XServer() {
    if (pid <= 0) return;
    kill(pid, SIGTERM);
    waitpid(pid, nullptr, 0);
  }
  XServer(const XServer&) = delete;
  XServer& operator=(const XServer&) = delete;
};

}  // namespace catgut
