// A client of `pushplan serve` over a Unix socket (docs/serve.md); it needs nothing of pushplan:
//   g++ -std=c++17 serve_client.cpp -o client && ./client /tmp/push.sock < requests

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <iostream>
#include <stdexcept>
#include <string>

void all(ssize_t (*move)(int, char*, size_t), int server, char* data, size_t count) {
  for (ssize_t done; count > 0; data += done, count -= done)
    if ((done = move(server, data, count)) <= 0) throw std::runtime_error("the server has gone");
}

ssize_t put(int to, char* data, size_t count) { return send(to, data, count, MSG_NOSIGNAL); }
ssize_t get(int from, char* data, size_t count) { return recv(from, data, count, 0); }

std::string request(int server, std::string body) {
  uint32_t length = htonl(body.size());
  std::string message(reinterpret_cast<char*>(&length), 4);
  message += body;
  all(put, server, message.data(), message.size());
  all(get, server, reinterpret_cast<char*>(&length), 4);
  std::string reply(ntohl(length), ' ');
  all(get, server, reply.data(), reply.size());
  return reply;
}

int main(int, char** arguments) {  // the path of the socket; requests come from standard input
  int server = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un where{AF_UNIX, ""};
  std::strncpy(where.sun_path, arguments[1], sizeof where.sun_path - 1);
  if (connect(server, reinterpret_cast<sockaddr*>(&where), sizeof where) != 0) return 1;
  for (std::string line; std::getline(std::cin, line);) std::cout << request(server, line) << "\n";
}
