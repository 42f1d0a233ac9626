/* Start of a Cortex-M program on QEMU's MPS2 boards: vectors, FPU on, semihosting of newlib. */
#include <stdint.h>
#include <stdlib.h>

extern uint32_t __stack_top, __bss_start__, __bss_end__;
extern int main(void);
extern void initialise_monitor_handles(void);

void Reset_Handler(void);
void Fault_Handler(void);
void _init(void);
void _fini(void);

__attribute__((section(".vectors"), used)) void (*const vectors[16])(void) = {
    (void (*)(void)) & __stack_top, Reset_Handler, Fault_Handler, Fault_Handler, Fault_Handler,
    Fault_Handler, Fault_Handler};

void Fault_Handler(void) { exit(99); }

void Reset_Handler(void) {
    uint32_t *p;
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* CPACR: access to the FPU */
    __asm volatile("dsb\n\tisb" ::: "memory");
    for (p = &__bss_start__; p < &__bss_end__; ++p) {
        *p = 0;
    }
    initialise_monitor_handles();
    exit(main());
}

/* newlib's exit asks for these */
void _init(void) {}
void _fini(void) {}
