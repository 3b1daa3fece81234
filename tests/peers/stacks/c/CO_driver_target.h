/* The types that CANopenNode wants of a CAN driver (its 301/CO_driver.h describes them), for the driver in canopennode.c. */
#ifndef CO_DRIVER_TARGET_H
#define CO_DRIVER_TARGET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hub.h"

#define CO_LITTLE_ENDIAN
#define CO_SWAP_16(x) x
#define CO_SWAP_32(x) x
#define CO_SWAP_64(x) x

typedef uint_fast8_t bool_t;
typedef float float32_t;
typedef double float64_t;

#define CO_CANrxMsg_readIdent(frame) (((const struct hub_frame *)(frame))->id)
#define CO_CANrxMsg_readDLC(frame) (((const struct hub_frame *)(frame))->length)
#define CO_CANrxMsg_readData(frame) (((const struct hub_frame *)(frame))->data)

/* A frame that is wanted: identifier, and 800h for a remote frame. */
typedef struct {
    uint16_t ident, mask;
    void *object;
    void (*CANrx_callback)(void *object, void *frame);
} CO_CANrx_t;

typedef struct {
    uint16_t ident;
    uint8_t DLC, data[8];
    bool_t remote;
    volatile bool_t bufferFull, syncFlag;
} CO_CANtx_t;

typedef struct {
    void *CANptr;
    CO_CANrx_t *rxArray;
    CO_CANtx_t *txArray;
    uint16_t rxSize, txSize, CANerrorStatus;
    volatile bool_t CANnormal;
} CO_CANmodule_t;

typedef struct {
    void *addr;
    size_t len;
    uint8_t subIndexOD, attr;
    void *addrNV;
} CO_storage_entry_t;

/* One thread does everything. */
#define CO_LOCK_CAN_SEND(module)
#define CO_UNLOCK_CAN_SEND(module)
#define CO_LOCK_EMCY(module)
#define CO_UNLOCK_EMCY(module)
#define CO_LOCK_OD(module)
#define CO_UNLOCK_OD(module)
#define CO_MemoryBarrier()
#define CO_FLAG_READ(flag) ((flag) != NULL)
#define CO_FLAG_SET(flag) ((flag) = (void *)1)
#define CO_FLAG_CLEAR(flag) ((flag) = NULL)

#endif
