// A wish to stop, SIGINT or SIGTERM, that ends what reads without end and lets the rest be done.
#ifndef DQW_APP_BASE_INTERRUPT_HPP
#define DQW_APP_BASE_INTERRUPT_HPP

namespace dqw {

/// From now on the first SIGINT or SIGTERM is a wish; the next one ends the program. Throws std::runtime_error.
void catch_interrupts();

/// True from the first of them on.
bool interrupted();

/// Waits until `fd` can be read or an interrupt came; at once where none is caught. False on an interrupt.
bool wait_to_read(int fd);

}  // namespace dqw
#endif
